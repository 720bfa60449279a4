"""The page that draws a PEM in a browser, and the server that shows it."""
