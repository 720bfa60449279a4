#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <vector>

#include "bind.hpp"
#include "bind_enums.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake::bindings {

void bind_image(nb::module_& m) {
  nb::class_<SaveReport>(m, "SaveReport", "What a file format could not hold.")
      .def_ro("clamped_to_half", &SaveReport::clamped_to_half,
              "Number of values beyond ±65504 that were clamped because the file stores float16.")
      .def_ro("clipped", &SaveReport::clipped,
              "Number of values outside [0,1] (in HDR: below 0), or NaN, that were clipped.")
      .def("__repr__", [](const SaveReport& r) {
        return "SaveReport(clamped_to_half=" + std::to_string(r.clamped_to_half) +
               ", clipped=" + std::to_string(r.clipped) + ")";
      });

  m.def(
      "load_image",
      [](const PathText& path) {
        Image image;
        {
          nb::gil_scoped_release released;
          image = load_image(path.text);
        }
        const std::size_t height = static_cast<std::size_t>(image.height);
        const std::size_t width = static_cast<std::size_t>(image.width);
        const std::size_t channels = image.channels.size();
        return nb::make_tuple(to_numpy(std::move(image.pixels), {height, width, channels}), image.channels);
      },
      nb::arg("path"),
      nb::sig("def load_image(path: str | os.PathLike[str]) -> tuple[NDArray[numpy.float32], list[str]]"),
      R"(Read an EXR, HDR, TIFF, PNG or JPEG as scene-linear float32 of shape (height, width, channels),
with the names of the channels. Integer formats are decoded from sRGB. Raises FileError.)");

  m.def(
      "save_image",
      [](const PathText& path, FloatImage pixels, std::optional<std::vector<std::string>> channels,
         PixelFormat format) {
        if (!channels) channels = default_channels(static_cast<int>(pixels.shape(2)));
        nb::gil_scoped_release released;
        return save_image(path.text, static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)),
                          *channels, {pixels.data(), pixels.size()}, format);
      },
      nb::arg("path"), nb::arg("pixels"), nb::arg("channels") = nb::none(),
      nb::arg("format") = PixelFormat::automatic,
      R"(Write scene-linear pixels of shape (height, width, channels) atomically; the extension of the
path decides the format. `channels` names the channels (default Y, YA, RGB or RGBA). `format`: automatic,
half, float32, uint8 or uint16. Raises FileError and InvalidArgument.)");
}

}  // namespace mirrorbake::bindings
