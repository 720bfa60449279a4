"""Benchmarks: each compares mirrorbake with a named peer in one run and fails if the answers differ."""
