// mb-envmap: inspects, converts, filters, samples and compares environment maps.

#include <CLI/CLI.hpp>

#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "envmap_command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/envmap/compare.hpp"
#include "mirrorbake/envmap/conventions.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/envmap/mipmap.hpp"
#include "mirrorbake/envmap/resample.hpp"
#include "mirrorbake/envmap/sampling.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "tool.hpp"

namespace {

using namespace mirrorbake;        // NOLINT(google-build-using-namespace): one program, one namespace
using namespace mirrorbake::tool;  // NOLINT(google-build-using-namespace)

void print_info(const Input& input, bool json) {
  const EnvMap map = input.load();
  std::vector<float> low(static_cast<std::size_t>(map.layout.channels),
                         std::numeric_limits<float>::infinity());
  std::vector<float> high(low.size(), -std::numeric_limits<float>::infinity());
  const std::span<const float> values = EnvMapView(map).level(0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t c = i % low.size();
    low[c] = std::min(low[c], values[i]);
    high[c] = std::max(high[c], values[i]);
  }
  std::vector<double> mean = integrate(map);
  const std::vector<double> angles =
      texel_solid_angles(map.layout.projection, map.layout.width, map.layout.height);
  double whole = 0.0;
  for (const double angle : angles) whole += angle;
  for (double& m : mean) m /= whole * face_count(map.layout.projection);
  const std::size_t bad = count_not_finite(map);
  if (json) {
    std::string names = "[";
    for (std::size_t c = 0; c < map.channels.size(); ++c)
      names += (c ? ", " : "") + json_string(map.channels[c]);
    std::cout << "{\"path\": " << json_string(input.path)
              << ", \"projection\": " << json_string(to_string(map.layout.projection))
              << ", \"width\": " << map.layout.width << ", \"height\": " << map.layout.height
              << ", \"faces\": " << face_count(map.layout.projection) << ", \"levels\": " << map.layout.levels
              << ", \"channels\": " << names << "], \"min\": " << json_list(low)
              << ", \"max\": " << json_list(high) << ", \"mean_radiance\": " << json_list(mean)
              << ", \"not_finite\": " << bad << "}\n";
    return;
  }
  std::cout << input.path << ": " << to_string(map.layout.projection) << ", "
            << face_count(map.layout.projection) << " face(s) of " << map.layout.width << " x "
            << map.layout.height << ", " << map.layout.levels << " level(s), " << map.layout.channels
            << " channel(s)\n";
  for (std::size_t c = 0; c < low.size(); ++c) {
    std::cout << "  " << (c < map.channels.size() ? map.channels[c] : std::to_string(c)) << ": " << low[c]
              << " to " << high[c] << ", mean radiance over the sphere " << mean[c] << '\n';
  }
  if (bad > 0) std::cout << "  " << bad << " values are NaN or infinite\n";
}

struct Convert {
  Input input;
  Output output;
  std::string projection;
  std::string size;
  std::string filter = "automatic";
  std::string convention = "mirrorbake";
  float turn = 0.0F;
  std::vector<float> axis = {0.0F, 1.0F, 0.0F};
  float exposure = 0.0F;

  CLI::Option* add_turn(CLI::App& app) {
    app.add_option("--axis", axis, "x y z of the axis of --turn")->expected(3)->capture_default_str();
    app.add_option("--exposure", exposure, "stops by which radiance is raised")->capture_default_str();
    return app
        .add_option("--turn", turn,
                    "degrees to turn the surroundings about the axis: about +Y from -Z towards +X")
        ->capture_default_str();
  }

  void run(bool json) const {
    if (!projection.empty()) output.check(parse_projection(projection));
    const EnvMap source = input.load();
    const Projection target = projection.empty() ? source.layout.projection : parse_projection(projection);
    if (projection.empty()) output.check(target);
    // About as many texels as the source has.
    const double texels = static_cast<double>(source.layout.level_texels(0)) / face_count(target);
    const int natural =
        std::max(1, static_cast<int>(std::lround(std::sqrt(texels / natural_aspect(target)))));
    const Size wanted = !size.empty()        ? parse_size(size, target)
                        : projection.empty() ? Size{source.layout.width, source.layout.height}
                                             : Size{natural * natural_aspect(target), natural};
    ResampleOptions options{parse_resample_filter(filter)};
    options.source_from_target = rotation();
    const bool same = target == source.layout.projection && wanted.width == source.layout.width &&
                      wanted.height == source.layout.height && turn == 0.0F;
    EnvMap result = same ? source : resample(source, target, wanted.width, wanted.height, options);
    if (convention != "mirrorbake")
      result = convert_convention(result, convention, ConventionWay::to_foreign);
    if (exposure != 0.0F) {
      for (float& value : result.values) value *= std::exp2(exposure);
    }
    output.save(result, json);
  }

  // Of directions in the result to those in the input, by Rodrigues' formula: the surroundings turn clockwise
  // for somebody whom the axis points at, about +Y from −Z towards +X.
  glm::mat3 rotation() const {
    const glm::vec3 given(axis[0], axis[1], axis[2]);
    if (!std::isfinite(glm::length(given)) || !(glm::length(given) > 0.0F)) {
      throw InvalidArgument("--axis", json_list(axis), "three finite numbers that are not all 0");
    }
    const glm::dvec3 a = glm::normalize(glm::dvec3(given));
    const double angle = glm::radians(static_cast<double>(turn));
    const glm::dmat3 cross(glm::dvec3(0, a.z, -a.y), glm::dvec3(-a.z, 0, a.x), glm::dvec3(a.y, -a.x, 0));
    return glm::mat3(glm::dmat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * cross * cross);
  }
};

void print_comparison(const Comparison& c, bool json) {
  if (json) {
    std::cout << "{\"max_error\": " << json_number(c.max_error)
              << ", \"mean_error\": " << json_number(c.mean_error)
              << ", \"rms_error\": " << json_number(c.rms_error)
              << ", \"relative_l2\": " << json_number(c.relative_l2) << ", \"psnr\": " << json_number(c.psnr)
              << ", \"flux_ratio\": " << json_number(c.flux_ratio) << ", \"not_finite\": " << c.not_finite
              << "}\n";
    return;
  }
  std::cout << "max error    " << c.max_error << "\nmean error   " << c.mean_error << "\nRMS error    "
            << c.rms_error << "\nrelative L2  " << c.relative_l2 << "\nPSNR         " << c.psnr
            << " dB\nflux ratio   " << c.flux_ratio << "\nnot finite   " << c.not_finite << '\n';
}

// Levels as KTX2, or as one image per level: {} in the path is the level's number then.
void write_mips(const EnvMap& map, MipFilter filter, const Output& output, bool json) {
  const std::size_t mark = output.path.find("{}");
  const bool one_file = mark == std::string::npos && stores_levels(output.path);
  if (one_file) {
    output.check(map.layout.projection);
    output.save(build_mips(map, filter), json);
    return;
  }
  if (mark == std::string::npos || stores_levels(output.path)) {
    throw InvalidArgument("--output", output.path,
                          "a .ktx2 or .dds file, or an image path with {} for the number of the level");
  }
  const auto numbered = [&](int level) {
    Output one = output;
    one.path.replace(mark, 2, std::to_string(level));
    return one;
  };
  numbered(0).check(map.layout.projection);
  const EnvMap mips = build_mips(map, filter);
  for (int level = 0; level < mips.layout.levels; ++level) {
    EnvMapLayout layout = mips.layout;
    layout.width = mips.layout.level_width(level);
    layout.height = mips.layout.level_height(level);
    layout.levels = 1;
    numbered(level).save(EnvMapView{layout, EnvMapView(mips).level(level), mips.channels}, json);
  }
}

// The widened faces are no environment map any more; they are packed like one, by default one below the
// other.
void write_border(const EnvMap& map, int border, Output output, bool json) {
  if (stores_levels(output.path)) {
    throw InvalidArgument("--output", output.path, "an image: faces with borders make no cube map");
  }
  if (output.layout == "automatic" && output.path.find("{}") == std::string::npos) output.layout = "column";
  output.check(map.layout.projection);
  const std::vector<float> wide = add_border(map, 0, border);
  EnvMapLayout layout = map.layout;
  layout.width += 2 * border;
  layout.height += 2 * border;
  layout.levels = 1;
  output.save(EnvMapView{layout, wide, map.channels}, json);
}

// The differentials of a square pixel that `degrees` of directions wide is, about a direction.
std::pair<glm::vec3, glm::vec3> pixel_around(glm::vec3 direction, float degrees) {
  const glm::vec3 axis =
      std::abs(direction.y) < std::abs(direction.x) ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
  const float width = 2.0F * std::tan(glm::radians(0.5F * degrees)) * glm::length(direction);
  const glm::vec3 across = width * glm::normalize(glm::cross(direction, axis));
  return {across, width * glm::normalize(glm::cross(direction, across))};
}

void print_samples(EnvMap map, const std::vector<std::vector<float>>& directions, SampleFilter filter,
                   float footprint, bool json) {
  std::vector<glm::vec3> d;
  for (const std::vector<float>& v : directions) {
    if (v.size() != 3) {
      throw InvalidArgument("--direction", json_list(v),
                            "three numbers; repeat the option for more directions");
    }
    d.emplace_back(v[0], v[1], v[2]);
  }
  if (!std::isfinite(footprint)) throw InvalidArgument("--footprint", text_of(footprint), "0 to 179 degrees");
  std::vector<glm::vec3> ddx(d.size(), glm::vec3(0.0F));
  std::vector<glm::vec3> ddy = ddx;
  if (filter == SampleFilter::trilinear || filter == SampleFilter::ewa) {
    if (map.layout.levels == 1) map = build_mips(map, MipFilter::seamless);
    for (std::size_t i = 0; i < d.size(); ++i) std::tie(ddx[i], ddy[i]) = pixel_around(d[i], footprint);
  }
  const std::size_t channels = static_cast<std::size_t>(map.layout.channels);
  std::vector<float> values(d.size() * channels);
  if (sample(map, d, ddx, ddy, {filter}, values) > 0) {
    throw InvalidArgument("--direction", "NaN, infinite or zero", "a finite vector of a length above 0");
  }
  for (std::size_t i = 0; i < d.size(); ++i) {
    const std::vector<float> texel(values.begin() + static_cast<std::ptrdiff_t>(i * channels),
                                   values.begin() + static_cast<std::ptrdiff_t>((i + 1) * channels));
    if (json) {
      std::cout << "{\"direction\": " << json_list(directions[i]) << ", \"value\": " << json_list(texel)
                << "}\n";
    } else {
      for (std::size_t c = 0; c < channels; ++c) std::cout << (c ? " " : "") << json_number(texel[c]);
      std::cout << '\n';
    }
  }
}

std::string describe(const std::string& path, const EnvMapLayout& layout) {
  return path + " (" + to_string(layout.projection) + ", " + std::to_string(layout.width) + " x " +
         std::to_string(layout.height) + ", " + std::to_string(layout.channels) + " channels)";
}

void compare_files(const Input& first, const Input& second, bool json) {
  const EnvMap map = first.load();
  const EnvMap reference = second.load();
  const EnvMapLayout& a = map.layout;
  const EnvMapLayout& b = reference.layout;
  if (a.projection != b.projection || a.width != b.width || a.height != b.height ||
      a.channels != b.channels) {
    throw FileError(describe(first.path, a),
                    "differs in projection, size or channels from " + describe(second.path, b));
  }
  print_comparison(compare(map, reference), json);
}

int run(int argc, char** argv) {
  CLI::App app("Inspects, converts, filters, samples and compares environment maps.", "mb-envmap");
  app.set_version_flag("--version", "mb-envmap " MIRRORBAKE_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  int threads = 0;
  bool json = false;
  app.add_option("--threads", threads, "threads to use, 0 for all")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_flag("--json", json, "print figures as JSON, one object per line");

  Input info;
  CLI::App* info_command = app.add_subcommand("info", "Projection, size, range and mean radiance of a map");
  info.add_options(*info_command);
  info.add_details(*info_command);

  Convert convert;
  CLI::App* convert_command =
      app.add_subcommand("convert", "Another projection, size, layout, orientation or format");
  convert.input.add_options(*convert_command);
  convert.input.add_details(*convert_command);
  convert.output.add_options(*convert_command);
  convert_command->add_option("--to", convert.projection, "projection to make, as for --from")->required();
  convert_command->add_option(
      "--size", convert.size,
      "texels of a face, HEIGHT or WIDTHxHEIGHT (default: as many texels as the input has)");
  convert_command->add_option("--filter", convert.filter, "automatic, area, bilinear or nearest")
      ->capture_default_str();
  convert_command
      ->add_option("--to-convention", convert.convention, "orientation to make, as for --from-convention")
      ->capture_default_str();
  convert.add_turn(*convert_command);

  Convert rotate;
  CLI::App* rotate_command =
      app.add_subcommand("rotate", "The same projection and size, turned about any axis");
  rotate.input.add_options(*rotate_command);
  rotate.input.add_details(*rotate_command);
  rotate.output.add_options(*rotate_command);
  rotate.add_turn(*rotate_command)->required();

  Input mips_input;
  Output mips_output;
  std::string mip_filter = "seamless";
  CLI::App* mips_command =
      app.add_subcommand("mips", "All levels of a map, as KTX2 or as one image per level");
  mips_input.add_options(*mips_command);
  mips_input.add_details(*mips_command);
  mips_output.add_options(*mips_command);
  mips_command->add_option("--filter", mip_filter, "box, solid_angle or seamless")->capture_default_str();

  Input border_input;
  Output border_output;
  int border = 1;
  CLI::App* border_command = app.add_subcommand(
      "border", "Faces widened by texels of their neighbours, one below the other or as --layout says");
  border_input.add_options(*border_command);
  border_input.add_details(*border_command);
  border_output.add_options(*border_command);
  border_command->add_option("--width", border, "texels to add on every side")->capture_default_str();

  Input sample_input;
  std::vector<std::vector<float>> directions;
  std::string sample_filter = "bilinear";
  CLI::App* sample_command = app.add_subcommand("sample", "Values of a map in given directions");
  sample_input.add_options(*sample_command);
  sample_input.add_details(*sample_command);
  sample_command->add_option("--direction", directions, "x y z, may be given several times")
      ->required()
      ->type_size(3);
  sample_command
      ->add_option("--filter", sample_filter,
                   "How the map is read; the last two use its levels, made if it has one")
      ->capture_default_str()
      ->check(CLI::IsMember({"nearest", "bilinear", "trilinear", "ewa"}));
  float footprint = 1.0F;
  sample_command->add_option("--footprint", footprint, "trilinear and ewa: degrees that are averaged")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 179.0));

  Input first;
  Input second;
  CLI::App* compare_command = app.add_subcommand("compare", "Errors of a map against a reference");
  first.add_options(*compare_command, "input");
  second.add_options(*compare_command, "reference");
  first.add_details(*compare_command, "both maps");

  const std::unique_ptr<EnvmapCommand> prefilter_command = add_prefilter(app);
  const std::unique_ptr<EnvmapCommand> preview_command = add_preview(app);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const ThreadLimit limit(threads);
  set_exr_threads(thread_count());
  if (*info_command) print_info(info, json);
  if (*convert_command) convert.run(json);
  if (*rotate_command) rotate.run(json);
  if (*mips_command) write_mips(mips_input.load(), parse_mip_filter(mip_filter), mips_output, json);
  if (*border_command) write_border(border_input.load(), border, border_output, json);
  if (*sample_command)
    print_samples(sample_input.load(), directions, parse_sample_filter(sample_filter), footprint, json);
  if (prefilter_command->wanted()) prefilter_command->run(json);
  if (preview_command->wanted()) preview_command->run(json);
  if (*compare_command) {
    second.projection = first.projection;
    second.layout = first.layout;
    second.convention = first.convention;
    compare_files(first, second, json);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return mirrorbake::tool::exit_status("mb-envmap", [&] { return run(argc, argv); });
}
