#include "core/world/resolve_layers.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/world/limits.h"

namespace tessera {
namespace {

constexpr char kDefaultLayer[] = "default";

std::string QuotedLayer(const std::string& name) {
  return absl::StrCat("\"", absl::Utf8SafeCEscape(name.substr(0, kMaxLayerLength)), "\"");
}

bool IsLayerName(const std::string& name) {
  const auto allowed = [](char c) { return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  return !name.empty() && name.size() <= kMaxLayerLength && std::ranges::all_of(name, allowed);
}

// Takes the names in, each once. False where there are more than a mask holds.
bool NameLayers(Faults& faults, const v1::Scene& in, std::vector<std::string>* names) {
  names->assign(1, kDefaultLayer);
  bool default_given = false;
  for (int i = 0; i < in.layers_size(); ++i) {
    const std::string& name = in.layers(i).name();
    faults.At(absl::StrCat("layers[", i, "]"));
    if (!IsLayerName(name)) {
      faults.Add(absl::StrCat("name must be of 1 to ", kMaxLayerLength, " letters, digits and underscores, got ",
                              QuotedLayer(name)));
    } else if (name == kDefaultLayer && !default_given) {
      default_given = true;
    } else if (std::ranges::find(*names, name) != names->end()) {
      faults.Add(absl::StrCat("name ", QuotedLayer(name), " is used twice"));
    } else if (names->size() == kMaxLayers) {
      faults.Add(absl::StrCat("is one layer too many: with \"default\" there may be ", kMaxLayers));
      return false;
    } else {
      names->push_back(name);
    }
  }
  return true;
}

}  // namespace

std::vector<CollisionLayer> ResolveLayers(Faults& faults, const v1::Scene& in, std::vector<std::string>* names) {
  const bool fits = NameLayers(faults, in, names);
  std::vector<CollisionLayer> layers(names->size());
  for (std::size_t i = 0; i < layers.size(); ++i) layers[i].index = static_cast<std::uint8_t>(i);
  for (int i = 0; fits && i < in.layers_size(); ++i) {
    const auto self = std::ranges::find(*names, in.layers(i).name());
    faults.At(absl::StrCat("layers[", i, "] (", QuotedLayer(in.layers(i).name()), ")"));
    for (int k = 0; k < in.layers(i).ignores_size(); ++k) {
      const std::string& ignored = in.layers(i).ignores(k);
      const auto other = std::ranges::find(*names, ignored);
      if (other == names->end()) {
        faults.Add(absl::StrCat("ignores[", k, "] ", QuotedLayer(ignored), " is not among the scene's layers"));
      } else if (std::find(in.layers(i).ignores().begin(), in.layers(i).ignores().begin() + k, ignored) !=
                 in.layers(i).ignores().begin() + k) {
        faults.Add(absl::StrCat("ignores[", k, "] ", QuotedLayer(ignored), " is named twice"));
      } else if (self != names->end()) {
        const auto a = static_cast<std::size_t>(self - names->begin()),
                   b = static_cast<std::size_t>(other - names->begin());
        layers[a].collides &= ~(1u << b);
        layers[b].collides &= ~(1u << a);
      }
    }
  }
  return layers;
}

}  // namespace tessera
