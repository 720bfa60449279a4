#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "mirrorbake/core/error.hpp"
#include "mirrorbake/image/image_io.hpp"

namespace mirrorbake {
namespace {

constexpr std::size_t kNone = ~std::size_t{0};

// The channels of one layer that are colours.
struct Colours {
  std::size_t rgb[3] = {kNone, kNone, kNone};
  std::size_t y = kNone;
  bool has_chroma = false;

  bool has_rgb() const { return rgb[0] != kNone && rgb[1] != kNone && rgb[2] != kNone; }
  // X, Y, Z are a place or a direction rather than a luminance.
  bool has_grey() const { return y != kNone && !has_chroma; }
};

bool is_one_of(std::string_view name, std::string_view letter, std::string_view word) {
  const auto equal = [&](std::string_view other) {
    return std::equal(name.begin(), name.end(), other.begin(), other.end(),
                      [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
  };
  return equal(letter) || equal(word);
}

void note(std::string_view suffix, std::size_t index, Colours& colours) {
  if (is_one_of(suffix, "R", "Red")) colours.rgb[0] = index;
  if (is_one_of(suffix, "G", "Green")) colours.rgb[1] = index;
  if (is_one_of(suffix, "B", "Blue")) colours.rgb[2] = index;
  if (is_one_of(suffix, "Y", "Luminance")) colours.y = index;
  if (is_one_of(suffix, "X", "RY") || is_one_of(suffix, "U", "BY")) colours.has_chroma = true;
}

Image picked(Image image, const Colours& colours) {
  const bool is_grey = !colours.has_rgb();
  if (image.channels.size() == (is_grey ? 1U : 3U) &&
      (is_grey || (colours.rgb[0] == 0 && colours.rgb[1] == 1))) {
    image.channels = is_grey ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
    return image;
  }
  Image result(image.width, image.height,
               is_grey ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"});
  const std::size_t count = result.channels.size();
  const std::size_t stride = image.channels.size();
  for (std::size_t i = 0, from = 0; i < result.pixels.size(); i += count, from += stride) {
    for (std::size_t c = 0; c < count; ++c) {
      result.pixels[i + c] = image.pixels[from + (is_grey ? colours.y : colours.rgb[c])];
    }
  }
  return result;
}

}  // namespace

Image colours_of(const std::string& name, Image image) {
  std::map<std::string_view, Colours> layers;
  for (std::size_t i = 0; i < image.channels.size(); ++i) {
    const std::string_view channel = image.channels[i];
    const std::size_t dot = channel.find_last_of('.');
    const bool is_layered = dot != std::string_view::npos;
    note(is_layered ? channel.substr(dot + 1) : channel, i, layers[is_layered ? channel.substr(0, dot) : ""]);
  }
  const auto own = layers.find("");
  if (own != layers.end() && (own->second.has_rgb() || own->second.has_grey())) {
    const Colours chosen = own->second;
    return picked(std::move(image), chosen);
  }
  std::optional<Colours> chosen;
  std::string found;
  for (const auto& [layer, colours] : layers) {
    if (layer.empty() || !colours.has_rgb()) continue;
    if (!chosen) chosen = colours;
    if (found.size() < 400) found += (found.empty() ? "" : ", ") + std::string(layer);
  }
  const bool several = found.find(", ") != std::string::npos;
  if (chosen && !several) return picked(std::move(image), *chosen);
  if (several)
    throw FileError(name, "has colours in the layers " + found + ", expected one of them to be chosen");
  std::string channels;
  for (const std::string& channel : image.channels) {
    if (channels.size() < 200) channels += (channels.empty() ? "" : ", ") + channel;
  }
  throw FileError(name, "has the channels " + channels + ", expected colours: R, G and B, or Y");
}

Image merge(const std::vector<std::pair<std::string, const Image*>>& images) {
  std::vector<std::string> names;
  for (const auto& [prefix, image] : images) {
    for (const std::string& channel : image->channels) names.push_back(prefix + channel);
  }
  Image merged(images.front().second->width, images.front().second->height, names);
  for (int y = 0; y < merged.height; ++y) {
    for (int x = 0; x < merged.width; ++x) {
      float* out = merged.at(x, y);
      for (const auto& [prefix, image] : images) {
        out = std::copy_n(image->at(x, y), image->channels.size(), out);
      }
    }
  }
  return merged;
}

}  // namespace mirrorbake
