// PageFiles: the built page in memory, as it goes over the wire.
//
// The folder is read once, and each file that shrinks is compressed then, at the highest level: who loads the page
// waits neither for a disk nor for a compressor, and a page that is built anew is served by a gateway that is started
// anew.
//
//   auto page = PageFiles::Read("web/dist");
//   const PageFile* file = page->Find("/assets/page.js");
//   Send(AcceptsGzip(header) && !file->gzip.empty() ? file->gzip : file->plain);
//
// Thread rule: any thread; nothing changes after Read.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "absl/status/statusor.h"

namespace tessera::gateway {

// The page has less than 1 MB; a folder that is named by mistake should not fill the memory.
inline constexpr std::size_t kMaxPage_bytes = 64'000'000;

struct PageFile {
  const char* type = nullptr;  // "text/javascript"
  std::string plain;
  std::string gzip;  // empty where it would not be smaller
  std::string tag;   // differs for other contents; without quotes
};

class PageFiles {
 public:
  // All files below `folder`. NOT_FOUND: it has no index.html. RESOURCE_EXHAUSTED: it has more than kMaxPage_bytes.
  static absl::StatusOr<PageFiles> Read(const std::string& folder);

  // `path` is that of the request: "/", "/assets/page.js". Null: there is none. Only what was read is found, so a path
  // leads nowhere else.
  const PageFile* Find(const std::string& path) const;
  bool empty() const { return files_.empty(); }

 private:
  std::map<std::string, PageFile> files_;  // by path
};

// Whether who sends this Accept-Encoding takes gzip (RFC 9110, 12.5.3).
bool AcceptsGzip(const std::string& accept_encoding);
// Whether who sends this If-None-Match has it already (RFC 9110, 13.1.2). `tag`: PageFile::tag.
bool HasTag(const std::string& if_none_match, const std::string& tag);

}  // namespace tessera::gateway
