#include "control_plane/bundle.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/wire_format_lite.h>
#include <unistd.h>

#include <limits>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/checkpoint_files.h"
#include "control_plane/message_cost.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

using google::protobuf::io::CodedInputStream;
using Wire = google::protobuf::internal::WireFormatLite;

constexpr char kMagic[] = "TESSERA CHECKPOINT 1\n";
constexpr std::size_t kMagicBytes = sizeof(kMagic) - 1, kHeaderBytes = kMagicBytes + kSha256Digits;
// A map of all regions that there may be, its files and its bodies' numbers.
constexpr std::uint32_t kMaxManifestBytes = 16U << 20, kMaxFileNameBytes = 64;

constexpr std::uint32_t TagOf(int field) {
  return static_cast<std::uint32_t>(field) << 3 | Wire::WIRETYPE_LENGTH_DELIMITED;
}

bool ReadText(CodedInputStream& in, std::uint32_t most, std::string& text) {
  std::uint32_t size = 0;
  return in.ReadVarint32(&size) && size <= most && in.ReadString(&text, static_cast<int>(size));
}

}  // namespace

std::string Bundle(const records::Bundle& bundle) {
  const std::string bytes = bundle.SerializeAsString();
  return absl::StrCat(kMagic, Sha256Hex(bytes), bytes);
}

void AddContent(records::Bundle& bundle, const std::string& name, std::string bytes) {
  records::Bundle::Content& content = *bundle.add_contents();
  content.set_name(name);
  content.set_bytes(std::move(bytes));
}

absl::StatusOr<BundleReader> BundleReader::Open(const DraftFile& file) {
  const auto magic = file.Read(0, kMagicBytes);
  if (!magic.ok() || *magic != kMagic) return absl::InvalidArgumentError("file: is no checkpoint of this version");
  const auto sum = file.Read(kMagicBytes, kSha256Digits);
  const auto hash = sum.ok() ? file.Hash(kHeaderBytes, file.size() - kHeaderBytes) : sum;
  if (!hash.ok() || *hash != *sum) return absl::DataLossError("file: has another checksum");
  BundleReader reader(file);
  if (!reader.Parse(kHeaderBytes)) return absl::DataLossError("file: is no checkpoint");
  if (absl::Status status = reader.CheckFiles(); !status.ok()) return status;
  return reader;
}

// As protobuf reads a records::Bundle, but for the contents, whose places alone are noted.
bool BundleReader::Parse(std::uint64_t begin) {
  if (file_.size() > std::numeric_limits<int>::max()) return false;
  lseek(file_.file(), static_cast<off_t>(begin), SEEK_SET);
  google::protobuf::io::FileInputStream stream(file_.file());
  CodedInputStream in(&stream);
  std::string text;
  while (const std::uint32_t tag = in.ReadTag()) {
    if (tag == TagOf(records::Bundle::kManifestFieldNumber)) {
      if (!ReadText(in, kMaxManifestBytes, text) ||
          !TakesAtMost(text, *records::Manifest::descriptor(), kMaxParsedBytes) || !manifest_.MergeFromString(text)) {
        return false;
      }
    } else if (tag == TagOf(records::Bundle::kContentsFieldNumber)) {
      std::uint32_t size = 0;
      if (!in.ReadVarint32(&size) || size > std::numeric_limits<int>::max()) return false;
      const CodedInputStream::Limit outer = in.PushLimit(static_cast<int>(size));
      std::string name;
      Place place;
      while (const std::uint32_t inner = in.ReadTag()) {
        if (inner == TagOf(records::Bundle::Content::kNameFieldNumber)) {
          if (!ReadText(in, kMaxFileNameBytes, name)) return false;
        } else if (inner == TagOf(records::Bundle::Content::kBytesFieldNumber)) {
          std::uint32_t bytes = 0;
          if (!in.ReadVarint32(&bytes)) return false;
          place = {begin + static_cast<std::uint64_t>(in.CurrentPosition()), bytes};
          if (bytes > std::numeric_limits<int>::max() || !in.Skip(static_cast<int>(bytes))) return false;
        } else if (!Wire::SkipField(&in, inner)) {
          return false;
        }
      }
      if (in.BytesUntilLimit() != 0) return false;
      in.PopLimit(outer);
      if (!contents_.emplace(std::move(name), place).second) return false;
    } else if (!Wire::SkipField(&in, tag)) {
      return false;
    }
  }
  return in.ConsumedEntireMessage();
}

absl::Status BundleReader::CheckFiles() const {
  std::set<std::string> names = {kSceneFile}, given;
  if (HasGameFile(manifest_)) names.insert(kGameFile);
  for (const v1::MapRegion& region : manifest_.map().regions()) names.insert(RegionFileName(region.id()));
  for (const records::ManifestFile& file : manifest_.files()) given.insert(file.name());
  if (given != names || manifest_.files_size() != static_cast<int>(names.size())) {
    return absl::InvalidArgumentError("file: its files are not the scene, the game and one for each region of its map");
  }
  for (const records::ManifestFile& file : manifest_.files()) {
    const auto place = contents_.find(file.name());
    if (place != contents_.end()) {
      const auto hash = file_.Hash(place->second.at, place->second.bytes);
      if (hash.ok() && *hash == file.hash()) continue;
    }
    return absl::DataLossError(absl::StrCat("file: ", file.name(), " is missing or damaged"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> BundleReader::Read(const std::string& name) const {
  const auto place = contents_.find(name);
  if (place == contents_.end()) return absl::NotFoundError(absl::StrCat("file: has no ", name));
  auto bytes = file_.Read(place->second.at, place->second.bytes);
  if (bytes.ok()) return bytes;
  return absl::DataLossError(absl::StrCat("file: ", name, ": ", bytes.status().message()));
}

}  // namespace tessera::control
