// mb-envmap compare: errors of a map against a reference.

#include <iostream>
#include <memory>
#include <string>

#include "envmap_command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/compare.hpp"

namespace mirrorbake::tool {
namespace {

void print_comparison(const Comparison& c, bool json) {
  if (json) {
    print({{"max_error", c.max_error},
           {"mean_error", c.mean_error},
           {"rms_error", c.rms_error},
           {"relative_l2", c.relative_l2},
           {"psnr", c.psnr},
           {"flux_ratio", c.flux_ratio},
           {"not_finite", c.not_finite}});
    return;
  }
  std::cout << "max error    " << c.max_error << "\nmean error   " << c.mean_error << "\nRMS error    "
            << c.rms_error << "\nrelative L2  " << c.relative_l2 << "\nPSNR         " << c.psnr
            << " dB\nflux ratio   " << c.flux_ratio << "\nnot finite   " << c.not_finite << '\n';
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

class Compare final : public Command {
 public:
  explicit Compare(CLI::App* app) : Command(app) {
    input_.add_options(*app, "input");
    reference_.add_options(*app, "reference");
    input_.add_details(*app, "both maps");
  }

  void run(bool json) const override {
    Input reference = input_;
    reference.path = reference_.path;
    compare_files(input_, reference, json);
  }

 private:
  Input input_, reference_;
};

}  // namespace

std::unique_ptr<Command> add_compare(CLI::App& app) {
  return std::make_unique<Compare>(app.add_subcommand("compare", "Errors of a map against a reference"));
}

}  // namespace mirrorbake::tool
