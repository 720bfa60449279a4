// mb-envmap mips and border: a map prepared for hardware that filters it.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "envmap_command.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/envmap/mipmap.hpp"

namespace mirrorbake::tool {
namespace {

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

class Mips final : public Command {
 public:
  explicit Mips(CLI::App* app) : Command(app) {
    input_.add_options(*app);
    input_.add_details(*app);
    output_.add_options(*app);
    app->add_option("--filter", filter_, listed_names<MipFilter>())->capture_default_str();
  }

  void run(bool json) const override {
    write_mips(input_.load(), parse_name<MipFilter>(filter_), output_, json);
  }

 private:
  Input input_;
  Output output_;
  std::string filter_ = "seamless";
};

class Border final : public Command {
 public:
  explicit Border(CLI::App* app) : Command(app) {
    input_.add_options(*app);
    input_.add_details(*app);
    output_.add_options(*app);
    app->add_option("--width", width_, "texels to add on every side")->capture_default_str();
  }

  void run(bool json) const override { write_border(input_.load(), width_, output_, json); }

 private:
  Input input_;
  Output output_;
  int width_ = 1;
};

}  // namespace

std::unique_ptr<Command> add_mips(CLI::App& app) {
  return std::make_unique<Mips>(
      app.add_subcommand("mips", "All levels of a map, as KTX2 or as one image per level"));
}

std::unique_ptr<Command> add_border(CLI::App& app) {
  return std::make_unique<Border>(app.add_subcommand(
      "border", "Faces widened by texels of their neighbours, one below the other or as --layout says"));
}

}  // namespace mirrorbake::tool
