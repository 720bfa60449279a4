#include <optional>

#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/interrupt.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/version.hpp"
#include "mirrorbake/image/missing_library.hpp"

namespace mirrorbake::bindings {
namespace {

struct ScopedLimit {
  std::optional<ThreadLimit> limit;  // none once its block has ended
};

unsigned long main_thread =
    0;  // as threading.main_thread().ident, on which Python runs its handlers of signals

/// Lets Python look at its signals; KeyboardInterrupt, or what a handler raises, stops the computation.
void raise_if_interrupted() {
  if (PyThread_get_thread_ident() != main_thread) return;
  const nb::gil_scoped_acquire held;
  if (PyErr_CheckSignals() != 0) throw nb::python_error();
}

}  // namespace

void bind_core(nb::module_& m) {
  nb::exception<InvalidArgument>(m, "InvalidArgument", PyExc_ValueError);
  nb::exception<FileError>(m, "FileError", PyExc_OSError);
  nb::exception<MissingLibrary>(m, "MissingLibrary", PyExc_ImportError);
  nb::exception<NumericalError>(m, "NumericalError", PyExc_ArithmeticError);

  main_thread =
      nb::cast<unsigned long>(nb::module_::import_("threading").attr("main_thread")().attr("ident"));
  set_interrupt_check(&raise_if_interrupted);

  m.def("version", &version, "Version of the compiled library, 'MAJOR.MINOR.PATCH'.");
  m.def("thread_count", &thread_count, "Number of threads that parallel loops use now.");
  nb::class_<ScopedLimit>(
      m, "ThreadLimit",
      R"(The library uses at most `threads` threads, 0 to 1024 (0: all cores), to the end of a block
`with ThreadLimit(1): ...`, or else while the object lives. The smallest of several holds.)")
      .def(
          "__init__",
          [](ScopedLimit* self, int threads) {
            new (self) ScopedLimit{std::make_optional<ThreadLimit>(threads)};
          },
          nb::arg("threads"))
      .def(
          "__enter__", [](nb::object self) { return self; }, nb::sig("def __enter__(self) -> ThreadLimit"))
      .def(
          "__exit__", [](ScopedLimit& self, const nb::args&) { self.limit.reset(); },
          nb::sig("def __exit__(self, *exception: object) -> None"));
}

}  // namespace mirrorbake::bindings
