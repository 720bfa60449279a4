// mb-envmap: inspects, converts, filters, samples and compares environment maps.

#include "envmap_command.hpp"

int main(int argc, char** argv) {
  using namespace mirrorbake::tool;  // NOLINT(google-build-using-namespace): one program, one namespace
  return run_program("mb-envmap", "Inspects, converts, filters, samples and compares environment maps.",
                     {add_info, add_convert, add_rotate, add_mips, add_border, add_sample, add_compare,
                      add_prefilter, add_preview, add_background},
                     argc, argv);
}
