#include "gateway/page_files.h"

#include <sodium.h>
#include <zlib.h>

#include <array>
#include <filesystem>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "host/files.h"

namespace tessera::gateway {
namespace {

namespace fs = std::filesystem;

constexpr int kGzipWindow = 15 + 16;  // the largest, with the header of gzip

const char* TypeOf(const fs::path& file) {
  static constexpr std::array<std::pair<const char*, const char*>, 10> kTypes{{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".wasm", "application/wasm"},
  }};
  for (const auto& [ending, type] : kTypes) {
    if (file.extension() == ending) return type;
  }
  return "application/octet-stream";
}

// Empty where it would not be smaller.
std::string Gzip(const std::string& plain) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzipWindow, 9, Z_DEFAULT_STRATEGY) != Z_OK) return "";
  std::string packed(deflateBound(&stream, plain.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(plain.data()));
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const bool done = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return done && packed.size() < plain.size() ? packed : "";
}

std::string TagOf(const std::string& plain) {
  std::array<unsigned char, 16> hash{};
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(plain.data()), plain.size(),
                     nullptr, 0);
  return absl::BytesToHexString({reinterpret_cast<const char*>(hash.data()), hash.size()});
}

}  // namespace

absl::StatusOr<PageFiles> PageFiles::Read(const std::string& folder) {
  PageFiles page;
  std::size_t left = kMaxPage_bytes;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (!at->is_regular_file(error)) continue;
    const fs::path& path = at->path();
    PageFile file{.type = TypeOf(path), .plain = {}, .gzip = {}, .tag = {}};
    auto plain = host::ReadFile(path.string(), left);
    if (!plain.ok()) {
      return absl::Status(plain.status().code(), absl::StrCat("--page ", folder, ": ", plain.status().message()));
    }
    file.plain = *std::move(plain);
    left -= file.plain.size();
    file.gzip = Gzip(file.plain);
    file.tag = TagOf(file.plain);
    page.files_.emplace(absl::StrCat("/", path.lexically_relative(folder).generic_string()), std::move(file));
  }
  if (page.Find("/") == nullptr) return absl::NotFoundError(absl::StrCat("--page ", folder, ": has no index.html"));
  return page;
}

const PageFile* PageFiles::Find(const std::string& path) const {
  const auto found = files_.find(path == "/" ? "/index.html" : path);
  return found == files_.end() ? nullptr : &found->second;
}

bool AcceptsGzip(const std::string& accept_encoding) {
  bool any = false;
  for (const absl::string_view part : absl::StrSplit(accept_encoding, ',')) {
    const std::vector<absl::string_view> fields = absl::StrSplit(part, ';');
    const absl::string_view name = absl::StripAsciiWhitespace(fields[0]);
    double weight = 1;
    for (std::size_t i = 1; i < fields.size(); ++i) {
      absl::string_view field = absl::StripAsciiWhitespace(fields[i]);
      if (absl::ConsumePrefix(&field, "q=") && !absl::SimpleAtod(field, &weight)) weight = 0;
    }
    if (absl::EqualsIgnoreCase(name, "gzip")) return weight > 0;
    any = any || (name == "*" && weight > 0);
  }
  return any;
}

bool HasTag(const std::string& if_none_match, const std::string& tag) {
  const std::string quoted = absl::StrCat("\"", tag, "\"");
  for (absl::string_view part : absl::StrSplit(if_none_match, ',')) {
    part = absl::StripAsciiWhitespace(part);
    if (part == "*") return true;
    absl::ConsumePrefix(&part, "W/");
    if (part == quoted) return true;
  }
  return false;
}

}  // namespace tessera::gateway
