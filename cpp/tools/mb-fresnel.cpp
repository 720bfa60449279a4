// mb-fresnel: Fresnel curves, plots, tables and the report of what each approximation costs (spec F1 to F5).
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/isa.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/image/atomic_file.hpp"
#include "mirrorbake/image/image_io.hpp"
#include "mirrorbake/shading/fresnel.hpp"
#include "mirrorbake/shading/fresnel_table.hpp"
#include "mirrorbake/shading/metals.hpp"

namespace mirrorbake {
namespace {

struct Options {
  std::string model = "dielectric";
  double r0 = 0.04;
  double ior = 1.5;
  double eta = 0.2;
  double k = 3.9;
  std::string metal = "gold";
  std::string illuminant = "D65";
  int size = 0;
  double max_error = 1e-3;
  std::string out;
  bool json = false;
  int threads = 0;
};

/// The curves asked for: one channel, or R, G, B for a metal.
std::vector<ReflectanceFunction> curves_of(const Options& options) {
  if (options.model == "metal") {
    const Metal metal = parse_metal(options.metal);
    const Illuminant illuminant = parse_name<Illuminant>(options.illuminant);
    std::vector<ReflectanceFunction> channels;
    for (int channel = 0; channel < 3; ++channel) {
      channels.emplace_back(
          [=](double c) { return std::clamp(metal_reflectance(metal, c, illuminant)[channel], 0.0, 1.0); });
    }
    return channels;
  }
  Fresnel fresnel;
  fresnel.model = parse_name<FresnelModel>(options.model);
  fresnel.r0 = glm::vec3(static_cast<float>(options.r0));
  fresnel.eta = glm::vec3(static_cast<float>(options.model == "conductor" ? options.eta : options.ior));
  fresnel.k = glm::vec3(static_cast<float>(options.k));
  // The loops over arrays check parameters, and name what is wrong.
  const std::vector<float> probe = {0.5F};
  std::vector<glm::vec3> unused(1);
  evaluate(fresnel, probe, unused);
  return {reflectance_function(fresnel, 0)};
}

void write_table(const Options& options) {
  const std::vector<ReflectanceFunction> curves = curves_of(options);
  std::size_t size = static_cast<std::size_t>(options.size);
  if (options.size == 0) {
    for (const ReflectanceFunction& curve : curves) {
      size = std::max(size, table_for_error(curve, options.max_error).values.size());
    }
  }
  std::vector<FresnelTable> tables;
  double max_error = 0;
  for (const ReflectanceFunction& curve : curves) {
    tables.push_back(make_table(curve, size));
    max_error = std::max(max_error, tables.back().max_error);
  }
  if (options.out.empty()) {
    std::printf(curves.size() == 3 ? "c,R,G,B\n" : "c,F\n");
    for (std::size_t i = 0; i < size; ++i) {
      std::printf("%.9g", static_cast<double>(i) / static_cast<double>(size - 1));
      for (const FresnelTable& table : tables) std::printf(",%.9g", static_cast<double>(table.values[i]));
      std::printf("\n");
    }
  } else {
    Image image(static_cast<int>(size), 1, default_channels(static_cast<int>(tables.size())));
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t channel = 0; channel < tables.size(); ++channel) {
        image.pixels[i * tables.size() + channel] = tables[channel].values[i];
      }
    }
    save_image(options.out, image, PixelFormat::float32);
  }
  std::fprintf(stderr, "%zu entries, largest error %.3g\n", size, max_error);
}

// Plot
// -----------------------------------------------------------------------------------------------------------

constexpr double kPlotWidth = 560, kPlotHeight = 360,
                 kPlotMargin = 56;  // of the axes and around them, in pixels

double plot_x(double degrees) { return kPlotMargin + kPlotWidth * degrees / 90.0; }
double plot_y(double reflectance) { return kPlotMargin + kPlotHeight * (1.0 - reflectance); }

template <typename... Values>
std::string text(const char* format, Values... values) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

std::string polyline(const ReflectanceFunction& curve, const char* style) {
  std::string points;
  for (int i = 0; i <= 360; ++i) {
    const double degrees = 0.25 * i;
    const double cosine = i == 360 ? 0.0 : std::cos(degrees * std::numbers::pi / 180.0);
    points += text("%.2f,%.2f ", plot_x(degrees), plot_y(curve(cosine)));
  }
  return "<polyline fill=\"none\" " + std::string(style) + " points=\"" + points + "\"/>\n";
}

std::string axes(const std::string& title) {
  std::string svg = "<g stroke=\"#ccc\">\n";
  for (int degrees = 0; degrees <= 90; degrees += 15) {
    svg += text("<path d=\"M%.1f %.1fV%.1f\"/>\n", plot_x(degrees), plot_y(0), plot_y(1));
  }
  for (int tenths = 0; tenths <= 10; tenths += 2) {
    svg += text("<path d=\"M%.1f %.1fH%.1f\"/>\n", plot_x(0), plot_y(0.1 * tenths), plot_x(90));
  }
  svg += "</g>\n";
  for (int degrees = 0; degrees <= 90; degrees += 15) {
    svg += text("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%d°</text>\n", plot_x(degrees),
                plot_y(0) + 18, degrees);
  }
  for (int tenths = 0; tenths <= 10; tenths += 2) {
    svg += text("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%.1f</text>\n", plot_x(0) - 6,
                plot_y(0.1 * tenths) + 4, 0.1 * tenths);
  }
  svg += text("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">angle of incidence</text>\n", plot_x(45),
              plot_y(0) + 38);
  return svg + text("<text x=\"%.1f\" y=\"%.1f\">", plot_x(0), plot_y(1) - 16) + title + "</text>\n";
}

std::string title_of(const Options& options) {
  if (options.model == "schlick") return text("Schlick, r0 = %g", options.r0);
  if (options.model == "dielectric") return text("dielectric, n = %g", options.ior);
  if (options.model == "conductor") return text("conductor, n = %g + %gi", options.eta, options.k);
  return std::string(to_string(parse_metal(options.metal))) + ", illuminant " + options.illuminant;
}

// Reflectance over the angle of incidence; dashed, what Schlick's approximation makes of the value at 0°.
void write_plot(const Options& options) {
  const std::vector<ReflectanceFunction> curves = curves_of(options);
  const std::vector<std::string> colours = curves.size() == 3
                                               ? std::vector<std::string>{"#d33", "#2a2", "#36d"}
                                               : std::vector<std::string>{"#333"};
  std::string svg = text(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\" font-family=\"sans-serif\" "
      "font-size=\"13\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
      kPlotWidth + 2 * kPlotMargin, kPlotHeight + 2 * kPlotMargin);
  const bool with_schlick = options.model != "schlick";
  svg += axes("Fresnel reflectance: " + title_of(options) + (with_schlick ? "; dashed: Schlick" : ""));
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const std::string stroke = "stroke=\"" + colours[i] + "\" ";
    svg += polyline(curves[i], (stroke + "stroke-width=\"2\"").c_str());
    if (!with_schlick) continue;
    const double r0 = curves[i](1.0);
    svg += polyline([r0](double c) { return fresnel_schlick(c, r0); },
                    (stroke + "stroke-dasharray=\"5 4\"").c_str());
  }
  svg += "</svg>\n";
  if (options.out.empty()) {
    std::fputs(svg.c_str(), stdout);
  } else {
    write_file(options.out, std::as_bytes(std::span(svg)));
  }
}

void print_metal(const Options& options) {
  const Metal metal = parse_metal(options.metal);
  const Illuminant illuminant = parse_name<Illuminant>(options.illuminant);
  const glm::dvec3 normal = metal_reflectance(metal, 1.0, illuminant);
  const MetalFit fit = fit_metal(metal, illuminant);
  const std::string name(to_string(metal));
  const std::string source(optical_constants(metal).source);
  const std::pair<const char*, glm::dvec3> rows[] = {{"normal_incidence", normal},
                                                     {"schlick_r0", fit.schlick.r0},
                                                     {"schlick_max_error", fit.schlick_error},
                                                     {"eta", fit.conductor.eta},
                                                     {"k", fit.conductor.k},
                                                     {"conductor_max_error", fit.conductor_error}};
  if (options.json) {
    tool::Json json = {{"metal", name}, {"illuminant", options.illuminant}, {"source", source}};
    for (const auto& [label, v] : rows) json[label] = {v.r, v.g, v.b};
    tool::print(json);
    return;
  }
  std::printf("%s, %s\nlinear Rec.709, CIE 1931 2°, illuminant %s\n", name.c_str(), source.c_str(),
              options.illuminant.c_str());
  for (const auto& [label, v] : rows) std::printf("%-28s %8.4f %8.4f %8.4f\n", label, v.r, v.g, v.b);
}

// Report
// -----------------------------------------------------------------------------------------------------------

constexpr std::size_t kReportCount = std::size_t{1} << 20;

/// Shortest of several runs, ns per evaluation.
double nanoseconds(const std::function<void()>& run) {
  double best = 1e300;
  for (int i = 0; i < 5; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run();
    const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - start;
    best = std::min(best, time.count());
  }
  return best / static_cast<double>(kReportCount);
}

struct Row {
  std::string material;
  double exact_float_error = 0;  // float32 against double
  double exact_ns = 0;
  double schlick_error = 0;  // r0 = F at normal incidence
  double schlick_ns = 0;
  std::optional<std::size_t> table_size;  // for max_error; none: not to be had with 65536 entries
  double table_error = 0;
  double table_ns = 0;
};

Row report_row(const std::string& name, double eta, double k, double max_error) {
  const auto n32 = static_cast<float>(eta);
  const auto k32 = static_cast<float>(k);
  const auto exact = [&](double c) {
    return fresnel_conductor(c, static_cast<double>(n32), static_cast<double>(k32));
  };
  std::vector<float> c(kReportCount);
  std::vector<float> f(kReportCount);
  for (std::size_t i = 0; i < c.size(); ++i) {
    c[i] = static_cast<float>(static_cast<double>(i) / static_cast<double>(c.size() - 1));
  }
  const auto error = [&] {
    double worst = 0;
    for (std::size_t i = 0; i < c.size(); ++i) {
      worst = std::max(worst, std::abs(static_cast<double>(f[i]) - exact(static_cast<double>(c[i]))));
    }
    return worst;
  };
  Row row;
  row.material = name;
  row.exact_ns = nanoseconds([&] { fresnel_conductor(c, n32, k32, f); });
  row.exact_float_error = error();
  const auto r0 = static_cast<float>(exact(1.0));
  row.schlick_ns = nanoseconds([&] { fresnel_schlick(c, r0, f); });
  row.schlick_error = error();
  try {
    const FresnelTable table = table_for_error(exact, max_error);
    row.table_size = table.values.size();
    row.table_ns = nanoseconds([&] { evaluate(table, c, f); });
    row.table_error = error();
  } catch (const NumericalError&) {
    // No table of this kind: the row says so.
  }
  return row;
}

void report(const Options& options) {
  std::vector<Row> rows;
  for (double n : {1.0001, 1.001, 1.01, 1.1, 1.33, 1.5, 2.0, 2.4, 4.0, 10.0, 50.0, 200.0}) {
    char name[32];
    std::snprintf(name, sizeof name, "n = %g", n);
    rows.push_back(report_row(name, n, 0.0, options.max_error));
  }
  for (Metal metal : all_metals()) {
    const Fresnel fit = fit_metal(metal).conductor;
    rows.push_back(report_row(std::string(to_string(metal)) + ", green", static_cast<double>(fit.eta.g),
                              static_cast<double>(fit.k.g), options.max_error));
  }
  const std::string isa(to_string(active_isa()));
  if (options.json) {
    tool::Json list = tool::Json::array();
    for (const Row& row : rows) {
      list.push_back({{"material", row.material},
                      {"exact_error", row.exact_float_error},
                      {"exact_ns", row.exact_ns},
                      {"schlick_error", row.schlick_error},
                      {"schlick_ns", row.schlick_ns},
                      {"table_size", row.table_size ? tool::Json(*row.table_size) : tool::Json(nullptr)},
                      {"table_error", row.table_error},
                      {"table_ns", row.table_ns}});
    }
    tool::print(
        {{"isa", isa}, {"threads", thread_count()}, {"max_error", options.max_error}, {"rows", list}});
    return;
  }
  std::printf("%-18s %10s %7s | %10s %7s | %7s %10s %7s   (%s, %d threads)\n", "material", "F2/F3 err", "ns",
              "F1 err", "ns", "F4 size", "err", "ns", isa.c_str(), thread_count());
  for (const Row& row : rows) {
    const std::string size = row.table_size ? std::to_string(*row.table_size) : "-";
    std::printf("%-18s %10.3g %7.3g | %10.3g %7.3g | %7s %10.3g %7.3g\n", row.material.c_str(),
                row.exact_float_error, row.exact_ns, row.schlick_error, row.schlick_ns, size.c_str(),
                row.table_error, row.table_ns);
  }
}

void add_curve_options(CLI::App& command, Options& options) {
  command.add_option("--model", options.model, "Which curve")
      ->check(CLI::IsMember({"schlick", "dielectric", "conductor", "metal"}))
      ->capture_default_str();
  command.add_option("--r0", options.r0, "schlick: reflectance at normal incidence, 0 to 1")
      ->capture_default_str();
  command.add_option("--ior", options.ior, "dielectric: relative index")->capture_default_str();
  command.add_option("--eta", options.eta, "conductor: refractive index")->capture_default_str();
  command.add_option("--k", options.k, "conductor: extinction coefficient")->capture_default_str();
  command.add_option("--metal", options.metal, "metal: name or symbol; R, G, B clamped to [0,1]")
      ->capture_default_str();
  command.add_option("--illuminant", options.illuminant, "metal: light its colour is seen in")
      ->check(CLI::IsMember({"D65", "E"}))
      ->capture_default_str();
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Fresnel curves, plots, tables and the report of what each approximation costs.",
               "mb-fresnel");
  app.set_version_flag("--version", "mb-fresnel " MIRRORBAKE_VERSION);
  app.failure_message(tool::usage_error);
  app.add_option("--threads", options.threads, "Threads, 0 for all cores")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.require_subcommand(1);
  app.fallthrough();

  CLI::App* table =
      app.add_subcommand("table", "A curve at equal steps of the cosine: CSV to stdout, or an image");
  add_curve_options(*table, options);
  table->add_option("--size", options.size, "Entries; 0 for as few as --max-error allows")
      ->check(CLI::Range(0, 65536))
      ->capture_default_str();
  table->add_option("--max-error", options.max_error, "Largest error of linear interpolation")
      ->capture_default_str();
  table->add_option("-o,--output", options.out,
                    "Image of size × 1 pixels, float32 (.exr, .tif) instead of CSV");
  table->callback([&] { write_table(options); });

  CLI::App* plot = app.add_subcommand("plot", "A curve over the angle of incidence, beside Schlick's: SVG");
  add_curve_options(*plot, options);
  plot->add_option("-o,--output", options.out, "File (.svg) instead of stdout");
  plot->callback([&] { write_plot(options); });

  CLI::App* metal =
      app.add_subcommand("metal", "Colour of a metal from its measured spectrum, and models fitted to it");
  metal->add_option("metal", options.metal, "Name or symbol")->required();
  metal->add_option("--illuminant", options.illuminant, "Light its colour is seen in")
      ->check(CLI::IsMember({"D65", "E"}))
      ->capture_default_str();
  metal->add_flag("--json", options.json, "One JSON object");
  metal->callback([&] { print_metal(options); });

  CLI::App* errors =
      app.add_subcommand("report", "Error and time of Schlick and tables against the full equations");
  errors->add_option("--max-error", options.max_error, "What tables are made for")->capture_default_str();
  errors->add_flag("--json", options.json, "One JSON object");
  errors->callback([&] { report(options); });

  std::optional<ThreadLimit> limit;
  app.parse_complete_callback([&] { limit.emplace(options.threads); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return 0;
}

}  // namespace
}  // namespace mirrorbake

int main(int argc, char** argv) {
  return mirrorbake::tool::exit_status("mb-fresnel", [&] { return mirrorbake::run(argc, argv); });
}
