#pragma once

/// Stopping long computations from outside, such as by Ctrl-C in an interpreter (docs/adr/0072).
namespace mirrorbake {

/// Throws to stop the computation that calls it. Called on every thread that computes.
using InterruptCheck = void (*)();

/// From now on parallel loops call `check` between their chunks, at most every 20 ms on each thread. What it
/// throws leaves the loop, once the other threads have ended their chunks. nullptr: nothing is called.
void set_interrupt_check(InterruptCheck check);

/// Calls the check from within a chunk, no more often than that, and leaves a loop that was stopped on
/// another thread: for chunks that take longer than a tenth of a second.
void poll_interrupt();

}  // namespace mirrorbake
