#include "client_sdk/scene_keeper.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/file_path.h"

namespace tessera::client {
namespace {

constexpr std::size_t kKeptAtOnce_bytes = std::size_t{64} * 1024;
constexpr std::int64_t kKeptAUnit_bytes = 4;  // the kernel and the sum take a gigabyte a second each

}  // namespace

SceneKeeper::SceneKeeper(std::string file, std::vector<std::uint8_t> bytes, std::optional<replication::Digest> sum)
    : file_(std::move(file)),
      part_(absl::StrCat(file_, ".", std::chrono::steady_clock::now().time_since_epoch().count(), ".part")),
      bytes_(std::move(bytes)),
      given_(sum) {
  std::error_code error;
  std::filesystem::create_directories(FilePath(file_).parent_path(), error);
  out_.open(FilePath(part_), std::ios::binary | std::ios::trunc);
  Begin(given_.value_or(replication::Digest()));
}

void SceneKeeper::Begin(const replication::Digest& sum) {
  out_.write(reinterpret_cast<const char*>(sum.data()), static_cast<std::streamsize>(sum.size()));
}

SceneKeeper::~SceneKeeper() {
  if (!bytes_.empty()) GiveUp();
}

void SceneKeeper::GiveUp() {
  out_.close();
  std::error_code error;
  std::filesystem::remove(FilePath(part_), error);
  bytes_.clear();
}

bool SceneKeeper::Go(WorkBudget& budget) {
  while (out_ && written_ < bytes_.size()) {
    if (!budget.left()) return false;
    const std::size_t size = std::min(kKeptAtOnce_bytes, bytes_.size() - written_);
    out_.write(reinterpret_cast<const char*>(bytes_.data() + written_), static_cast<std::streamsize>(size));
    if (!given_) sum_.Add(std::span(bytes_).subspan(written_, size));
    written_ += size;
    budget.Spend(static_cast<std::int64_t>(size) / kKeptAUnit_bytes);
  }
  if (!given_) {
    out_.seekp(0);
    Begin(sum_.Finish());
  }
  out_.close();
  std::error_code error;
  if (out_) std::filesystem::rename(FilePath(part_), FilePath(file_), error);
  if (!out_ || error) {
    GiveUp();
  } else {
    bytes_.clear();
  }
  return true;
}

}  // namespace tessera::client
