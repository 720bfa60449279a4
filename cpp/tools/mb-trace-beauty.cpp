// mb-trace beauty: radiance of everything.

#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "trace_command.hpp"

namespace mirrorbake::tool {
namespace {

class Beauty final : public Command {
 public:
  explicit Beauty(CLI::App* app) : Command(app) {
    request_.add_options(*app);
    app->add_option("--noise", noise_,
                    "trace each tile until its relative standard error is this, in (0, 1]; --spp is then the "
                    "most it takes, at least 16");
    app->add_flag("--aovs", aovs_, "coverage A, depth Z, normal, position, albedo and object number as well");
  }

  void run(bool json) const override {
    const Stopwatch watch;
    check_image_path(request_.output, parse_name<PixelFormat>(request_.format));
    const TraceOptions options = request_.trace_options();
    Source source = request_.load();
    const Camera camera = request_.camera(source);
    const Tracer tracer = request_.tracer(std::move(source));
    BeautyTrace trace;
    if (noise_) {
      trace = tracer.trace_beauty_to_noise(camera, *noise_, options);
    } else {
      trace.image = tracer.trace_beauty(camera, options);
      trace.mean_samples_per_pixel = options.samples_per_pixel;
    }
    if (aovs_) {
      const Image geometry = tracer.trace_geometry(camera, options);
      request_.save(merge({{"", &trace.image}, {"", &geometry}}));
    } else {
      request_.save(trace.image);
    }
    if (noise_ && trace.share_above > 0.0) {
      std::cerr << "mb-trace: warning: " << 100.0 * trace.share_above << " % of the tiles need more than "
                << options.samples_per_pixel << " samples per pixel for a noise of " << *noise_ << '\n';
    }
    if (!json) {
      if (noise_) {
        std::cerr << "mb-trace: noise " << trace.noise << " after " << trace.mean_samples_per_pixel
                  << " samples per pixel\n";
      }
      return;
    }
    Json report = {{"output", request_.output},
                   {"width", trace.image.width},
                   {"height", trace.image.height},
                   {"samples_per_pixel", trace.mean_samples_per_pixel},
                   {"noise", nullptr}};
    if (noise_) {
      report["noise"] = trace.noise;
      report["tiles_above_noise"] = trace.share_above;
    }
    report["seconds"] = watch.seconds();
    print(report);
  }

 private:
  Request request_;
  std::optional<float> noise_;
  bool aovs_ = false;
};

}  // namespace

std::unique_ptr<Command> add_beauty(CLI::App& app) {
  return std::make_unique<Beauty>(app.add_subcommand("beauty", "Radiance of everything: R, G, B"));
}

}  // namespace mirrorbake::tool
