#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfTileDescription.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <utility>

#include "exr_file.hpp"
#include "mirrorbake/core/error.hpp"
#include "mirrorbake/core/parallel.hpp"
#include "mirrorbake/core/text.hpp"
#include "mirrorbake/image/primaries.hpp"

namespace mirrorbake::image_files {
namespace {

class BytesStream : public Imf::IStream {
 public:
  BytesStream(const std::string& name, const Bytes& bytes) : Imf::IStream(name.c_str()), bytes_(bytes) {}

  bool read(char* to, int count) override {
    const std::size_t wanted = static_cast<std::size_t>(std::max(count, 0));
    if (bytes_.read(position_, {reinterpret_cast<unsigned char*>(to), wanted}) != wanted) {
      throw std::runtime_error("early end of file");
    }
    position_ += wanted;
    return position_ < bytes_.size();
  }

  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  const Bytes& bytes_;
  std::uint64_t position_ = 0;
};

// Without threads of its own: OpenEXR's are one pool for the whole program, which is not ours to resize.
constexpr int kNoThreads = 0;

struct OpenFile {
  std::unique_ptr<BytesStream> stream;
  std::unique_ptr<Imf::MultiPartInputFile> file;
};

OpenFile open(const std::string& name, const Bytes& bytes) {
  OpenFile result;
  result.stream = std::make_unique<BytesStream>(name, bytes);
  result.file = std::make_unique<Imf::MultiPartInputFile>(*result.stream, kNoThreads);
  return result;
}

bool equal_but_for_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char c, unsigned char d) { return std::tolower(c) == std::tolower(d); });
}

std::pair<std::string_view, std::string_view> layer_and_suffix(std::string_view channel) {
  const std::size_t dot = channel.find_last_of('.');
  if (dot == std::string_view::npos) return {"", channel};
  return {channel.substr(0, dot + 1), channel.substr(dot + 1)};
}

// Files store their channels in the order of the alphabet. As in OpenImageIO, colours come first within a
// layer and alpha after them; an X with a Y or a Z makes coordinates.
std::vector<std::string> in_usual_order(const std::vector<std::string>& names) {
  constexpr std::array<std::string_view, 20> kUsual = {"R",    "Red",  "G",  "Green", "B",     "Blue", "Y",
                                                       "real", "imag", "A",  "Alpha", "AR",    "RA",   "AG",
                                                       "GA",   "AB",   "BA", "Z",     "Depth", "Zback"};
  constexpr std::array<std::string_view, 21> kCoordinates = {
      "R", "Red",   "G",  "Green", "B",  "Blue", "X",  "Y",  "Z",     "real", "imag",
      "A", "Alpha", "AR", "RA",    "AG", "GA",   "AB", "BA", "Depth", "Zback"};
  struct Layer {
    bool has_x = false;
    bool has_y_or_z = false;
  };
  std::map<std::string_view, Layer> layers;
  for (const std::string& name : names) {
    const auto [layer, suffix] = layer_and_suffix(name);
    if (equal_but_for_case(suffix, "X")) layers[layer].has_x = true;
    if (equal_but_for_case(suffix, "Y") || equal_but_for_case(suffix, "Z")) layers[layer].has_y_or_z = true;
  }
  std::vector<std::tuple<std::string_view, std::ptrdiff_t, std::string_view, std::size_t>> keys;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto [layer, suffix] = layer_and_suffix(names[i]);
    const bool coordinates = layers[layer].has_x && layers[layer].has_y_or_z;
    const std::span<const std::string_view> order =
        coordinates ? std::span<const std::string_view>(kCoordinates) : kUsual;
    const auto rank =
        std::find_if(order.begin(), order.end(),
                     [s = suffix](std::string_view known) { return equal_but_for_case(s, known); }) -
        order.begin();
    keys.emplace_back(layer, static_cast<std::size_t>(rank) < order.size() ? rank : 10000, suffix, i);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::string> sorted;
  for (const auto& key : keys) sorted.push_back(names[std::get<3>(key)]);
  return sorted;
}

// Bytes of pixels from one byte of the file: deflate gives at most 1032, and 4 for 3 in PXR24; PIZ a run of
// 256 words for ten bits; DWA 8 × 8 floats for two deflated bytes of their mean and two that end the block. 0
// for what comes after them.
std::uint64_t most_expansion(Imf::Compression compression) {
  switch (compression) {
    case Imf::NO_COMPRESSION:
    case Imf::RLE_COMPRESSION:
    case Imf::ZIPS_COMPRESSION:
    case Imf::ZIP_COMPRESSION:
    case Imf::PIZ_COMPRESSION:
    case Imf::PXR24_COMPRESSION:
    case Imf::B44_COMPRESSION:
    case Imf::B44A_COMPRESSION: return 1400;
    case Imf::DWAA_COMPRESSION:
    case Imf::DWAB_COMPRESSION: return std::uint64_t{1} << 17;
    default: return 0;
  }
}

// Rows that one task reads: whole blocks, lest they be unpacked twice.
std::size_t rows_per_task(const Imf::Header& header) {
  constexpr std::size_t kRows = 64;
  if (header.hasTileDescription()) {
    const std::size_t tile = std::max(1u, header.tileDescription().ySize);
    return tile * ((kRows + tile - 1) / tile);
  }
  return header.compression() < Imf::DWAB_COMPRESSION ? kRows : 256;
}

// Sides that do not fit become negative, which no limits accept.
Window window_of(const Imath::Box2i& box) {
  const auto side = [](int first, int last) {
    const std::int64_t size = std::int64_t{last} - first + 1;
    return size > std::numeric_limits<int>::max() ? -1 : static_cast<int>(size);
  };
  return {box.min.x, box.min.y, side(box.min.x, box.max.x), side(box.min.y, box.max.y)};
}

bool has_colours(const Imf::Header& part) {
  for (auto c = part.channels().begin(); c != part.channels().end(); ++c) {
    const std::string_view suffix = layer_and_suffix(c.name()).second;
    for (const std::string_view colour : {"R", "Red", "Y"}) {
      if (equal_but_for_case(suffix, colour)) return true;
    }
  }
  return false;
}

std::string part_name(const Imf::Header& part, int number) {
  return part.hasName() ? valid_utf8(part.name()) : std::to_string(number);
}

// The part that is asked for by name or number, or else the first with colours: depth is often a part of its
// own.
int chosen_part(const std::string& name, const Imf::MultiPartInputFile& file, const std::string& wanted) {
  std::string known;
  for (int i = 0; i < file.parts(); ++i) {
    const Imf::Header& part = file.header(i);
    if (wanted.empty() ? has_colours(part) : wanted == part_name(part, i) || wanted == std::to_string(i)) {
      return i;
    }
    if (i < 16) known += (i > 0 ? ", " : "") + part_name(part, i);
  }
  if (wanted.empty()) return 0;
  throw FileError(name, "has no part '" + valid_utf8(wanted) + "', expected one of " + known);
}

// A channel under the name that it has here.
struct Channel {
  std::string name;
  std::string stored;
};

// Those of the layer that is asked for, without its name, or all. V-Ray names those in no layer ".R" and so
// on.
std::vector<Channel> chosen_channels(const std::string& name, const std::vector<std::string>& stored,
                                     const std::string& layer) {
  std::vector<Channel> result;
  std::string known;
  for (const std::string& channel : stored) {
    const auto [prefix, suffix] = layer_and_suffix(channel);
    if (layer.empty()) {
      const bool is_free = prefix == "." && std::find(stored.begin(), stored.end(), suffix) == stored.end();
      result.push_back({valid_utf8(is_free ? suffix : std::string_view(channel)), channel});
    } else if (channel.starts_with(layer + ".")) {
      result.push_back({valid_utf8(channel.substr(layer.size() + 1)), channel});
    }
    if (prefix.size() > 1 && known.size() < 400) {
      const std::string shown = valid_utf8(prefix.substr(0, prefix.size() - 1));
      if (!known.ends_with(shown)) known += (known.empty() ? "" : ", ") + shown;
    }
  }
  if (!result.empty()) return result;
  throw FileError(name, "has no layer '" + valid_utf8(layer) + "', expected " +
                            (known.empty() ? "none: its channels are in no layer" : "one of " + known));
}

// What turns the part's colours into those of Rec. 709, if they are others.
std::optional<glm::dmat3> rec709_from_part(const std::string& name, const Imf::Header& part) {
  if (!Imf::hasChromaticities(part)) return std::nullopt;
  const Imf::Chromaticities& c = Imf::chromaticities(part);
  const auto xy = [](const Imath::V2f& v) { return glm::dvec2(v.x, v.y); };
  const Primaries primaries = {xy(c.red), xy(c.green), xy(c.blue), xy(c.white)};
  constexpr double kSame = 1e-3;  // chromaticities are rounded in many ways
  double difference = 0.0;
  const Primaries ours = rec709_primaries();
  for (std::size_t i = 0; i < ours.size(); ++i) {
    difference =
        std::max({difference, std::abs(primaries[i].x - ours[i].x), std::abs(primaries[i].y - ours[i].y)});
  }
  if (difference < kSame) return std::nullopt;
  const glm::dmat3 matrix = rec709_from_xyz() * xyz_from_rgb(primaries);
  for (int i = 0; i < 9; ++i) {
    if (!std::isfinite(matrix[i / 3][i % 3]) || std::abs(matrix[i / 3][i % 3]) > 1e6) {
      throw FileError(name, "has chromaticities that describe no colours");
    }
  }
  return matrix;
}

// Of each layer that has all three.
std::vector<std::array<std::size_t, 3>> colour_triples(const std::vector<std::string>& channels) {
  constexpr std::array<std::array<std::string_view, 2>, 3> kNames = {
      {{"R", "Red"}, {"G", "Green"}, {"B", "Blue"}}};
  std::map<std::string_view, std::array<std::size_t, 3>> found;
  std::map<std::string_view, int> counts;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const auto [layer, suffix] = layer_and_suffix(channels[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      if (!equal_but_for_case(suffix, kNames[c][0]) && !equal_but_for_case(suffix, kNames[c][1])) continue;
      found[layer][c] = i;
      ++counts[layer];
    }
  }
  std::vector<std::array<std::size_t, 3>> triples;
  for (const auto& [layer, triple] : found) {
    if (counts[layer] == 3) triples.push_back(triple);
  }
  return triples;
}

void convert_colours(const glm::dmat3& rec709_from_file, const std::vector<std::string>& channels,
                     std::span<float> pixels) {
  for (const std::array<std::size_t, 3>& triple : colour_triples(channels)) {
    for (std::size_t i = 0; i < pixels.size(); i += channels.size()) {
      float* p = pixels.data() + i;
      const glm::dvec3 colour = rec709_from_file * glm::dvec3(p[triple[0]], p[triple[1]], p[triple[2]]);
      for (int c = 0; c < 3; ++c) p[triple[static_cast<std::size_t>(c)]] = static_cast<float>(colour[c]);
    }
  }
}

// Luminance, with chroma of half the size in both directions ("Technical Introduction to OpenEXR").
bool is_luminance_chroma(const Imf::Header& part) {
  const auto is = [&](const char* channel, int sampling) {
    const Imf::Channel* c = part.channels().findChannel(channel);
    return c != nullptr && c->xSampling == sampling && c->ySampling == sampling;
  };
  return is("Y", 1) && is("RY", 2) && is("BY", 2);
}

void describe(const Imf::Header& source, Header& header) {
  header.data = window_of(source.dataWindow());
  header.display = window_of(source.displayWindow());
  header.says_linear = true;
  header.expansion = most_expansion(source.compression());
  if (source.hasTileDescription()) {
    const Imf::TileDescription& tile = source.tileDescription();
    const auto side = [](unsigned int size) { return static_cast<int>(std::min(size, 0x7fffffffU)); };
    header.tile = {0, 0, side(tile.xSize), side(tile.ySize)};
  }
}

class ExrReader : public Reader {
 public:
  ExrReader(const std::string& name, std::shared_ptr<const Bytes> bytes, const OpenFile& opened, int part,
            const std::string& layer)
      : name_(name), bytes_(std::move(bytes)), part_(part) {
    const Imf::Header& source = opened.file->header(part_);
    describe(source, header_);
    std::vector<std::string> channels;
    for (auto c = source.channels().begin(); c != source.channels().end(); ++c)
      channels.emplace_back(c.name());
    for (Channel& channel : chosen_channels(name_, in_usual_order(channels), layer)) {
      const Imf::Channel& c = *source.channels().findChannel(channel.stored.c_str());
      if (c.xSampling != 1 || c.ySampling != 1) {
        throw FileError(name_,
                        "its channel " + channel.name + " is subsampled, expected a value for every pixel");
      }
      header_.pixel_bits += c.type == Imf::HALF ? 16 : 32;
      header_.channels.push_back(std::move(channel.name));
      stored_.push_back(std::move(channel.stored));
    }
    const auto alpha =
        std::find_if(header_.channels.begin(), header_.channels.end(), [](const auto& channel) {
          const std::string_view suffix = layer_and_suffix(channel).second;
          return equal_but_for_case(suffix, "A") || equal_but_for_case(suffix, "Alpha");
        });
    if (alpha != header_.channels.end()) header_.alpha = static_cast<int>(alpha - header_.channels.begin());
    rec709_from_file_ = rec709_from_part(name_, source);
    rows_per_task_ = rows_per_task(source);
  }

  const Header& header() const override { return header_; }

  void read(std::span<float> pixels) override {
    const Window& window = header_.data;
    const std::size_t pixel_bytes = header_.channels.size() * sizeof(float);
    Imf::FrameBuffer frame;
    for (std::size_t c = 0; c < stored_.size(); ++c) {
      frame.insert(stored_[c], Imf::Slice::Make(Imf::FLOAT, pixels.data() + c, Imath::V2i(window.x, window.y),
                                                window.width, window.height, pixel_bytes,
                                                pixel_bytes * static_cast<std::size_t>(window.width)));
    }
    parallel_for(static_cast<std::size_t>(window.height), rows_per_task_,
                 [&](std::size_t begin, std::size_t end) {
                   // One that is open reads for one thread at a time.
                   const OpenFile opened = open(name_, *bytes_);
                   Imf::InputPart part(*opened.file, part_);
                   if (window_of(part.header().dataWindow()) != window)
                     throw FileError(name_, "changed while it was read");
                   part.setFrameBuffer(frame);
                   part.readPixels(window.y + static_cast<int>(begin), window.y + static_cast<int>(end) - 1);
                 });
    if (rec709_from_file_) convert_colours(*rec709_from_file_, header_.channels, pixels);
  }

 private:
  std::string name_;
  std::shared_ptr<const Bytes> bytes_;
  int part_;
  Header header_;
  std::vector<std::string> stored_;
  std::optional<glm::dmat3> rec709_from_file_;
  std::size_t rows_per_task_ = 1;
};

// OpenEXR's own reconstruction of colours from luminance and chroma, on half floats.
class LuminanceChromaReader : public Reader {
 public:
  LuminanceChromaReader(const std::string& name, std::shared_ptr<const Bytes> bytes, const OpenFile& opened)
      : name_(name), bytes_(std::move(bytes)) {
    const Imf::Header& source = opened.file->header(0);
    describe(source, header_);
    header_.channels = {"R", "G", "B"};
    header_.pixel_bits = 24;  // Y, and a quarter of two more
    if (source.channels().findChannel("A") != nullptr) {
      header_.channels.emplace_back("A");
      header_.alpha = 3;
    }
    rec709_from_file_ = rec709_from_part(name_, source);
  }

  const Header& header() const override { return header_; }

  void read(std::span<float> pixels) override {
    const Window& window = header_.data;
    const std::size_t width = static_cast<std::size_t>(window.width);
    const std::size_t channels = header_.channels.size();
    BytesStream stream(name_, *bytes_);
    Imf::RgbaInputFile file(stream, kNoThreads);
    std::vector<Imf::Rgba> row(width);
    for (int y = 0; y < window.height; ++y) {
      // The frame buffer's origin is that of the plane, wherever the window is.
      const std::ptrdiff_t first = std::ptrdiff_t{window.x};
      file.setFrameBuffer(row.data() - first, 1, 0);
      file.readPixels(window.y + y);
      float* to = pixels.data() + static_cast<std::size_t>(y) * width * channels;
      for (std::size_t x = 0; x < width; ++x, to += channels) {
        to[0] = row[x].r;
        to[1] = row[x].g;
        to[2] = row[x].b;
        if (channels == 4) to[3] = row[x].a;
      }
    }
    if (rec709_from_file_) convert_colours(*rec709_from_file_, header_.channels, pixels);
  }

 private:
  std::string name_;
  std::shared_ptr<const Bytes> bytes_;
  Header header_;
  std::optional<glm::dmat3> rec709_from_file_;
};

}  // namespace

std::unique_ptr<Reader> open_exr(const std::string& name, std::shared_ptr<const Bytes> bytes,
                                 const ImageChoice& choice) {
  check_exr(name, *bytes);
  const OpenFile opened = open(name, *bytes);
  const int part = chosen_part(name, *opened.file, choice.part);
  const Imf::Header& source = opened.file->header(part);
  if (source.hasType() && Imf::isDeepData(source.type())) {
    throw FileError(name, "holds deep samples, expected flat pixels");
  }
  if (part == 0 && choice.layer.empty() && is_luminance_chroma(source)) {
    return std::make_unique<LuminanceChromaReader>(name, std::move(bytes), opened);
  }
  return std::make_unique<ExrReader>(name, std::move(bytes), opened, part, choice.layer);
}

}  // namespace mirrorbake::image_files
