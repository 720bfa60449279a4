#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/version.hpp"

namespace mirrorbake::bindings {

void bind_core(nb::module_& m) {
  nb::exception<InvalidArgument>(m, "InvalidArgument", PyExc_ValueError);
  nb::exception<FileError>(m, "FileError", PyExc_OSError);
  nb::exception<NumericalError>(m, "NumericalError", PyExc_ArithmeticError);

  m.def("version", &version, "Version of the compiled library, 'MAJOR.MINOR.PATCH'.");
  m.def("thread_count", &thread_count, "Number of threads that parallel loops use now.");
  nb::class_<ThreadLimit>(m, "ThreadLimit",
                          "While it lives, the library uses at most `threads` threads (0: all cores).")
      .def(nb::init<int>(), nb::arg("threads"));
}

}  // namespace mirrorbake::bindings
