#include "control_plane/etcd/etcd_values.h"

#include <algorithm>
#include <numeric>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "core/world/sha256.h"

namespace tessera::control {
namespace {

namespace pb = etcdserverpb;

// The first byte of what lies under a key.
constexpr char kEtcdInline = 'v', kEtcdChunked = 'c';
// Chunks that one call reads.
constexpr std::int64_t kEtcdChunksAtOnce = 8, kEtcdKeysAtOnce = 1000;
// Tries of a chunk whose write was not answered: writing it again does no harm.
constexpr int kEtcdChunkTries = 3;

struct Chunked {
  std::string version;
  std::size_t bytes = 0;
  std::string hash;  // SHA-256
};

std::string ToText(const Chunked& chunked) {
  return absl::StrCat(std::string(1, kEtcdChunked), chunked.version, " ", chunked.bytes, " ", chunked.hash);
}

absl::StatusOr<Chunked> ReadChunked(std::string_view key, const std::string& stored) {
  const std::vector<std::string> parts = absl::StrSplit(absl::string_view(stored).substr(1), ' ');
  Chunked chunked;
  if (parts.size() != 3 || !absl::SimpleAtoi(parts[1], &chunked.bytes)) {
    return absl::DataLossError(absl::StrCat("store: ", std::string(key), ": cannot be read"));
  }
  chunked.version = parts[0];
  chunked.hash = parts[2];
  return chunked;
}

void AddRangeRemoval(std::string from, std::string to, std::vector<pb::RequestOp>& operations) {
  pb::DeleteRangeRequest& removal = *operations.emplace_back().mutable_request_delete_range();
  removal.set_key(std::move(from));
  removal.set_range_end(std::move(to));
}

}  // namespace

std::string EtcdDataKey(std::string_view prefix, std::string_view key) {
  return absl::StrCat(std::string(prefix), "/data/", std::string(key));
}

EtcdValues::EtcdValues(const EtcdClient& client, std::string prefix, EtcdFence fence)
    : client_(client), prefix_(std::move(prefix)), fence_(std::move(fence)) {}

std::string EtcdValues::Folder(std::string_view key) const {
  return absl::StrCat(prefix_, "/chunk/", absl::BytesToHexString(absl::string_view(key.data(), key.size())), "/");
}

// --- Reading.

absl::StatusOr<std::string> EtcdValues::Decode(std::string_view key, const std::string& stored) const {
  auto found = Read(key, stored);
  if (!found.ok()) return found.status();
  if (!found->fault.ok()) return found->fault;
  return std::move(found->bytes);
}

absl::StatusOr<EtcdValues::Found> EtcdValues::Read(std::string_view key, const std::string& stored) const {
  if (!stored.empty() && stored.front() == kEtcdInline) return Found{stored.substr(1), absl::OkStatus()};
  if (stored.empty() || stored.front() != kEtcdChunked) {
    return Found{stored, absl::DataLossError(absl::StrCat("store: ", std::string(key), ": cannot be read"))};
  }
  const auto chunked = ReadChunked(key, stored);
  if (!chunked.ok()) return Found{stored, chunked.status()};
  const std::string folder = absl::StrCat(Folder(key), chunked->version, "/");
  pb::RangeRequest request;
  request.set_key(folder);
  request.set_range_end(EtcdRangeEnd(folder));
  request.set_limit(kEtcdChunksAtOnce);
  std::string value;
  for (bool more = true; more;) {
    const auto page = client_.Range(request, kEtcdReadPatience);
    if (!page.ok()) return page.status();
    for (const pb::KeyValue& chunk : page->kvs()) value += chunk.value();
    more = page->more() && page->kvs_size() > 0;
    if (more) request.set_key(page->kvs().rbegin()->key() + '\0');
  }
  absl::Status fault;
  if (value.empty()) {
    fault = absl::NotFoundError(absl::StrCat("store: ", std::string(key), ": its chunks are gone"));
  } else if (value.size() != chunked->bytes || Sha256Hex(value) != chunked->hash) {
    fault = absl::DataLossError(absl::StrCat("store: ", std::string(key), ": its chunks are not whole"));
  }
  return Found{std::move(value), std::move(fault)};
}

// --- Writing.

absl::StatusOr<std::vector<std::string>> EtcdValues::Encode(std::span<const StoreOp> ops) {
  std::size_t inline_bytes = 0;
  std::vector<std::size_t> by_size;
  for (std::size_t i = 0; i < ops.size(); ++i) {
    if (ops[i].kind != StoreOp::Kind::kPut) continue;
    inline_bytes += ops[i].value.size();
    by_size.push_back(i);
  }
  std::sort(by_size.begin(), by_size.end(),
            [&](std::size_t a, std::size_t b) { return ops[a].value.size() > ops[b].value.size(); });
  std::vector<std::string> stored(ops.size());
  // The largest go into chunks until the rest fits.
  for (const std::size_t i : by_size) {
    if (inline_bytes > kEtcdInlineBytes) {
      inline_bytes -= ops[i].value.size();
      auto pointer = PutChunks(ops[i]);
      if (!pointer.ok()) return pointer.status();
      stored[i] = *std::move(pointer);
    } else {
      stored[i] = absl::StrCat(std::string(1, kEtcdInline), ops[i].value);
    }
  }
  return stored;
}

absl::StatusOr<std::string> EtcdValues::PutChunks(const StoreOp& op) {
  chunked_.insert(op.key);
  // The token is this leader's alone, so the version is this value's alone; and later ones are greater as text.
  const Chunked chunked{.version = absl::StrFormat("%016x%016x", fence_.token, ++made_),
                        .bytes = op.value.size(),
                        .hash = Sha256Hex(op.value)};
  const std::string folder = absl::StrCat(Folder(op.key), chunked.version, "/");
  for (std::size_t at = 0, number = 0; at < op.value.size(); at += kEtcdChunkBytes, ++number) {
    const auto bytes = std::string_view(op.value).substr(at, kEtcdChunkBytes);
    absl::Status put = PutChunk(absl::StrCat(folder, absl::StrFormat("%08d", number)), bytes);
    if (!put.ok()) return put;
  }
  return ToText(chunked);
}

absl::Status EtcdValues::PutChunk(const std::string& key, std::string_view bytes) const {
  pb::TxnRequest request;
  fence_.AddTo(request);
  pb::PutRequest& put = *request.add_success()->mutable_request_put();
  put.set_key(key);
  put.set_value(std::string(bytes));
  for (int tried = 1;; ++tried) {
    const auto written = client_.Write(request, kEtcdWritePatience);
    if (written.ok() && written->succeeded()) return absl::OkStatus();
    if (written.ok()) return absl::FailedPreconditionError("store: this control plane no longer leads");
    if (tried == kEtcdChunkTries || !EtcdClient::IsAmbiguous(written.status())) return written.status();
  }
}

void EtcdValues::AddRemovals(const std::string& key, const std::string& stored,
                             std::vector<pb::RequestOp>& operations) const {
  if (!chunked_.contains(key)) return;
  const std::string folder = Folder(key);
  const bool points = !stored.empty() && stored.front() == kEtcdChunked;
  const std::string version = points ? stored.substr(1, stored.find(' ') - 1) : "";
  AddRangeRemoval(folder, points ? folder + version : EtcdRangeEnd(folder), operations);
}

void EtcdValues::NoteWritten(const std::string& key, const std::string& stored) {
  if (stored.empty() || stored.front() != kEtcdChunked) chunked_.erase(key);
}

// --- Orphans.

absl::Status EtcdValues::Collect() {
  std::map<std::string, std::set<std::string>> versions;  // by key
  const std::string all = prefix_ + "/chunk/";
  pb::RangeRequest request;
  request.set_key(all);
  request.set_range_end(EtcdRangeEnd(all));
  request.set_limit(kEtcdKeysAtOnce);
  request.set_keys_only(true);
  for (bool more = true; more;) {
    const auto page = client_.Range(request, kEtcdReadPatience);
    if (!page.ok()) return page.status();
    for (const pb::KeyValue& chunk : page->kvs()) {
      const std::vector<std::string> parts = absl::StrSplit(absl::string_view(chunk.key()).substr(all.size()), '/');
      if (parts.size() == 3) versions[absl::HexStringToBytes(parts[0])].insert(parts[1]);
    }
    more = page->more() && page->kvs_size() > 0;
    if (more) request.set_key(page->kvs().rbegin()->key() + '\0');
  }
  for (const auto& [key, found] : versions) {
    if (absl::Status status = RemoveOrphans(key, found); !status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status EtcdValues::RemoveOrphans(const std::string& key, const std::set<std::string>& versions) {
  pb::RangeRequest request;
  request.set_key(EtcdDataKey(prefix_, key));
  const auto pointer = client_.Range(request, kEtcdReadPatience);
  if (!pointer.ok()) return pointer.status();
  std::string used;
  if (pointer->kvs_size() == 1 && pointer->kvs(0).value().starts_with(kEtcdChunked)) {
    const auto chunked = ReadChunked(key, pointer->kvs(0).value());
    chunked_.insert(key);
    if (!chunked.ok()) return absl::OkStatus();  // which are its own is not known: all go with it
    used = chunked->version;
  }
  for (const std::string& version : versions) {
    if (version == used) continue;
    std::vector<pb::RequestOp> removals;
    const std::string folder = absl::StrCat(Folder(key), version, "/");
    AddRangeRemoval(folder, EtcdRangeEnd(folder), removals);
    pb::TxnRequest removal;
    fence_.AddTo(removal);
    *removal.add_success() = removals.front();
    const auto removed = client_.Write(removal, kEtcdWritePatience);
    if (!removed.ok()) return removed.status();
    if (!removed->succeeded()) return absl::FailedPreconditionError("store: this control plane no longer leads");
  }
  return absl::OkStatus();
}

}  // namespace tessera::control
