#include <optional>

#include "bind.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/version.hpp"

namespace mirrorbake::bindings {
namespace {

struct ScopedLimit {
  std::optional<ThreadLimit> limit;  // none once its block has ended
};

}  // namespace

void bind_core(nb::module_& m) {
  nb::exception<InvalidArgument>(m, "InvalidArgument", PyExc_ValueError);
  nb::exception<FileError>(m, "FileError", PyExc_OSError);
  nb::exception<NumericalError>(m, "NumericalError", PyExc_ArithmeticError);

  m.def("version", &version, "Version of the compiled library, 'MAJOR.MINOR.PATCH'.");
  m.def("thread_count", &thread_count, "Number of threads that parallel loops use now.");
  nb::class_<ScopedLimit>(
      m, "ThreadLimit",
      "The library uses at most `threads` threads, 0 to 1024 (0: all cores), to the end of a block\n"
      "`with ThreadLimit(1): ...`, or else while the object lives. The smallest of several holds.")
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
