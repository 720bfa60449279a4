// mb-trace: path-traced images of a scene, the segmented layers of its reflectors, and environment maps of
// it.

#include "trace_command.hpp"

int main(int argc, char** argv) {
  using namespace mirrorbake::tool;  // NOLINT(google-build-using-namespace): one program, one namespace
  return run_program("mb-trace",
                     "Path-traced images of a scene, layers of its reflectors, and environment maps of it.",
                     {add_beauty, add_layers, add_capture}, argc, argv);
}
