// mb-envmap prefilter: maps of the light that a lobe gathers, and light as spherical harmonics.

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "envmap_command.hpp"
#include "mirrorbake/envmap/envmap_io.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/prefilter/convolve.hpp"
#include "mirrorbake/prefilter/harmonics.hpp"
#include "mirrorbake/prefilter/split_sum.hpp"

namespace mirrorbake::tool {
namespace {

// Numbers divided by white space or commas.
std::vector<double> read_table(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw FileError(path, "cannot be read");
  std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::replace(text.begin(), text.end(), ',', ' ');
  std::vector<double> values;
  const char* at = text.data();
  const char* end = at + text.size();
  for (;;) {
    while (at != end && std::isspace(static_cast<unsigned char>(*at))) ++at;
    if (at == end) return values;
    double value = 0.0;
    const auto [rest, error] = std::from_chars(at, end, value);
    if (error != std::errc()) {
      throw FileError(path, "number " + std::to_string(values.size() + 1) + " is not one; expected weights");
    }
    values.push_back(value);
    at = rest;
  }
}

bool has_extension(const std::string& path, std::string_view extension) {
  return path.size() >= extension.size() &&
         std::equal(extension.rbegin(), extension.rend(), path.rbegin(), [](char wanted, char c) {
           return wanted == std::tolower(static_cast<unsigned char>(c));
         });
}

Json rows_as_json(const std::vector<double>& values, int channels) {
  Json rows = Json::array();
  const auto n = static_cast<std::ptrdiff_t>(channels);
  for (auto row = values.begin(); row != values.end(); row += n) {
    rows.push_back(std::vector<double>(row, row + n));
  }
  return rows;
}

// Coefficients of radiance, as mirrorbake.prefilter.Harmonics reads them, and what shaders take.
Json harmonics_as_json(const Harmonics& light) {
  Json json = {{"order", light.order}, {"coefficients", rows_as_json(light.coefficients, light.channels)}};
  if (light.order >= 2) json["shader_constants"] = rows_as_json(shader_constants(light), light.channels);
  if (light.order == 2 && light.channels == 3) json["three_js"] = light.coefficients;
  return json;
}

// One row of (order + 1)² texels.
EnvMap harmonics_as_image(const Harmonics& light, std::span<const std::string> names) {
  EnvMap row = make_envmap({{ProjectionKind::latlong},
                            static_cast<int>(light.coefficients.size()) / light.channels,
                            1,
                            1,
                            light.channels},
                           names);
  std::transform(light.coefficients.begin(), light.coefficients.end(), row.values.begin(),
                 [](double c) { return static_cast<float>(c); });
  return row;
}

class Prefilter final : public Command {
 public:
  explicit Prefilter(CLI::App* app) : Command(app), given_(app) {
    input_.add_options(*app);
    input_.add_details(*app);
    output_.add_options(*app);
    app->add_option("--model", model_, "irradiance, sh, phong, ggx or table")
        ->required()
        ->check(CLI::IsMember({"irradiance", "sh", "phong", "ggx", "table"}));
    app->add_option("--to", projection_, "projection to make, as for --from")->capture_default_str();
    app->add_option("--size", size_, "texels of a face, HEIGHT or WIDTHxHEIGHT")->capture_default_str();
    only("phong", app->add_option("--exponent", exponent_, "phong: 1 to 1e6")->capture_default_str());
    only("ggx", app->add_option("--alpha", alpha_,
                                "ggx: one lobe of this width, 0.01 to 1, instead of a chain of levels"));
    only("ggx", app->add_option("--levels", levels_, "ggx: levels of the chain, 0 down to 4 x 4 texels")
                    ->capture_default_str());
    only("ggx", app->add_flag("--linear-roughness", linear_,
                              "ggx: alpha rises with the level, not with its square"));
    only("ggx", app->add_option("--split-sum", split_sum_,
                                "ggx: also write the table of the second sum to this image"));
    only("table",
         app->add_option("--table", table_, "table: file of weights at equal steps of the angle from 0"));
    only("table",
         app->add_option("--table-angle", table_angle_, "table: degrees of the last weight, up to 180")
             ->capture_default_str());
    only("sh", app->add_option("--order", order_, "sh: highest band, 0 to 8")->capture_default_str());
    only("sh", app->add_option("--window", window_, "sh, against ringing: " + listed_names<HarmonicWindow>())
                   ->capture_default_str());
    only("sh", app->add_flag("--keep-negative", keep_negative_, "sh: keep irradiance below 0 in images"));
    only("sh",
         app->add_flag("--coefficients", coefficients_, "sh: write the coefficients as a row of an image"));
    app->add_option("--scale", scale_,
                    "mean, which keeps white white, or sum over the lobe (default: sum for irradiance)")
        ->check(CLI::IsMember({"mean", "sum"}));
  }

  void run(bool json) const override {
    for (const auto& [model, option] : only_) {
      if (option->count() > 0 && model != model_) {
        throw InvalidArgument(option->get_name(), "given with --model " + model_, "--model " + model);
      }
    }
    check_options_of_results();
    if (!split_sum_.empty()) check_envmap_path(split_sum_, {ProjectionKind::angular});
    if (model_ == "sh") {
      run_harmonics(json);
    } else if (model_ == "ggx" && !alpha_) {
      run_chain(json);
    } else {
      run_lobe(json);
    }
  }

 private:
  // What says nothing about what is made is refused, too.
  void check_options_of_results() const {
    const auto refuse = [&](std::initializer_list<const char*> names, const char* with,
                            const char* expected) {
      for (const char* name : names) {
        if (given_->count(name) > 0) throw InvalidArgument(name, with, expected);
      }
    };
    if (model_ == "sh") {
      refuse({"--scale"}, "given with --model sh", "--model irradiance, phong, ggx or table");
      const bool as_json = has_extension(output_.path, ".json");
      if (as_json) refuse({"--coefficients", "--layout", "--format"}, "given for a .json file", "an image");
      if (as_json || coefficients_) {
        refuse({"--to", "--size", "--keep-negative"}, "given for coefficients", "a map of irradiance");
      }
    } else if (model_ == "ggx" && !alpha_) {
      refuse({"--scale"}, "given for a chain", "--alpha for one lobe");
    } else if (model_ == "ggx") {
      refuse({"--levels"}, "given with --alpha", "one of them");
      if (split_sum_.empty()) refuse({"--linear-roughness"}, "given with --alpha", "one of them");
    }
  }

  // Options of one model.
  void only(const char* model, CLI::Option* option) { only_.emplace_back(model, option); }

  EnvMap load() const {
    EnvMap map = input_.read();
    if (const std::size_t bad = count_not_finite(map); bad > 0) {
      throw FileError(input_.path, "has " + std::to_string(bad) +
                                       " NaN or infinite values, expected none; --repair fills them");
    }
    return map;
  }

  void run_lobe(bool json) const {
    const PrefilterTarget target = target_of();
    output_.check(target.projection);
    Lobe lobe;
    if (model_ == "phong") {
      lobe = {LobeKind::phong, exponent_};
    } else if (model_ == "ggx") {
      lobe = {LobeKind::ggx, 1.0, *alpha_};
    } else if (model_ == "table") {
      if (table_.empty()) throw InvalidArgument("--table", "missing", "a file of weights");
      lobe.kind = LobeKind::table;
      lobe.table = read_table(table_);
      lobe.table_angle = table_angle_;
    }
    validate(lobe);
    const bool sum = scale_ == "sum" || (scale_.empty() && model_ == "irradiance");
    const EnvMap source = load();
    // Only for someone who watches.
    std::function<void(double)> progress;
    if (isatty(STDERR_FILENO) != 0) {
      progress = [](double done) {
        std::cerr << "\rmb-envmap: " << static_cast<int>(100.0 * done) << " %" << (done < 1.0 ? "" : "\n")
                  << std::flush;
      };
    }
    output_.save(Convolver(source).apply(lobe, target, sum ? LobeScale::sum : LobeScale::mean, progress),
                 json);
    write_split_sum();
  }

  void run_chain(bool json) const {
    if (parse_projection(projection_).kind != ProjectionKind::cube) {
      throw InvalidArgument("--to", projection_, "cube for a chain; give --alpha for one lobe");
    }
    const PrefilterTarget target = target_of();
    ChainOptions options;
    options.size = target.height;
    options.levels = levels_;
    options.roughness = linear_ ? RoughnessScale::linear : RoughnessScale::squared;
    options.progress = [](int level, int levels) {
      std::cerr << "mb-envmap: level " << level + 1 << " of " << levels << '\n';
    };
    const std::size_t mark = output_.path.find("{}");
    if (mark == std::string::npos && !stores_levels(output_.path)) {
      throw InvalidArgument("--output", output_.path,
                            "a .ktx2 or .dds file, or an image path with {} for the number of the level");
    }
    const auto numbered = [&](int level) {
      Output one = output_;
      if (mark != std::string::npos) one.path.replace(mark, 2, std::to_string(level));
      return one;
    };
    numbered(0).check({ProjectionKind::cube});
    const EnvMap chain = ggx_chain(load(), options);
    if (mark == std::string::npos) {
      output_.save(chain, json);
    } else {
      for (int level = 0; level < chain.layout.levels; ++level) {
        EnvMapLayout layout = chain.layout;
        layout.width = chain.layout.level_width(level);
        layout.height = chain.layout.level_height(level);
        layout.levels = 1;
        numbered(level).save(EnvMapView{layout, EnvMapView(chain).level(level), chain.channels}, json);
      }
    }
    write_split_sum();
  }

  void run_harmonics(bool json) const {
    const bool as_json = has_extension(output_.path, ".json");
    const HarmonicWindow window = parse_name<HarmonicWindow>(window_);
    const PrefilterTarget target = target_of();
    if (!as_json) output_.check(coefficients_ ? Projection{ProjectionKind::latlong} : target.projection);
    const EnvMap source = load();
    const Harmonics light = project_harmonics(source, order_);
    if (as_json || coefficients_) {
      const Harmonics damped = windowed(light, window);
      if (!as_json) return output_.save(harmonics_as_image(damped, source.channels), json);
      const std::string text = line_of(harmonics_as_json(damped));
      write_file(output_.path, {reinterpret_cast<const std::byte*>(text.data()), text.size()});
      if (json) {
        print({{"output", output_.path}, {"order", order_}});
      }
      return;
    }
    EnvMap map = evaluate_harmonics(windowed(lambert_harmonics(light), window), target,
                                    keep_negative_ ? NegativeLight::keep : NegativeLight::clamp);
    map.channels = source.channels;
    output_.save(map, json);
  }

  void write_split_sum() const {
    if (split_sum_.empty()) return;
    constexpr int kSize = 128;
    const std::vector<float> table =
        split_sum_table(kSize, linear_ ? RoughnessScale::linear : RoughnessScale::squared);
    const std::vector<std::string> names{"R", "G", "B"};
    warn_of_losses(
        "mb-envmap", split_sum_,
        save_envmap(split_sum_, EnvMapView{{{ProjectionKind::angular}, kSize, kSize, 1, 3}, table, names}));
  }

  PrefilterTarget target_of() const {
    const Projection projection = parse_projection(projection_);
    const Size size = parse_size(size_, projection);
    return {projection, size.width, size.height};
  }

  const CLI::App* given_;
  Input input_;
  Output output_;
  std::string model_;
  std::string projection_ = "cube";
  std::string size_ = "128";
  double exponent_ = 50.0;
  std::optional<double> alpha_;
  int levels_ = 0;
  bool linear_ = false;
  std::string split_sum_;
  std::string table_;
  double table_angle_ = 180.0;
  int order_ = 2;
  std::string window_ = "none";
  bool keep_negative_ = false;
  bool coefficients_ = false;
  std::string scale_;
  std::vector<std::pair<std::string, CLI::Option*>> only_;
};

}  // namespace

std::unique_ptr<Command> add_prefilter(CLI::App& app) {
  return std::make_unique<Prefilter>(app.add_subcommand(
      "prefilter", "Maps of diffuse and glossy reflection, and light as spherical harmonics"));
}

}  // namespace mirrorbake::tool
