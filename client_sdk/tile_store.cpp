#include "client_sdk/tile_store.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "absl/strings/str_cat.h"
#include "client_sdk/file_path.h"

namespace tessera::client {
namespace {

constexpr std::size_t kKeptHeadBytes = sizeof(replication::Digest);  // see scene_keeper.h
constexpr std::size_t kTileAtOnce_bytes = std::size_t{32} * 1024;
// Bytes that a unit reads from a file, sums and unpacks, as of a scene; and tiles of the list that it looks at.
constexpr std::int64_t kTileReadAUnit_bytes = 8, kTileSummedAUnit_bytes = 4, kTileUnpackedAUnit_bytes = 2,
                       kTilesLookedAtAUnit = 2;

std::string HexOf(const Sha256::Digest& digest) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (const std::uint8_t byte : digest) {
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

}  // namespace

TileStore::TileStore(std::shared_ptr<const Scene> scene, std::shared_ptr<const LevelIndex> index, std::string cache_dir)
    : scene_(std::move(scene)),
      index_(std::move(index)),
      cache_dir_(std::move(cache_dir)),
      known_(index_->tiles.size()) {}

void TileStore::Look(std::vector<Place> places) {
  places_ = std::move(places);
  const auto moved = [this](const Place& a, const Place& b) {
    const bool far = std::hypot(a.at.x - b.at.x, a.at.z - b.at.z) > kStepOfEdge * index_->edge_m;
    return far || a.radius_m != b.radius_m;
  };
  choose_ = choose_ || places_.size() != chosen_for_.size();
  for (std::size_t i = 0; i < places_.size() && !choose_; ++i) choose_ = moved(places_[i], chosen_for_[i]);
}

std::optional<double> TileStore::DistanceTo(std::uint32_t tile, double more_m) const {
  const Aabb& bounds = EntryOf(tile).bounds;
  const Rect ground{bounds.min.x, bounds.min.z, bounds.max.x, bounds.max.z};
  std::optional<double> least_m;
  for (const Place& place : places_) {
    const double distance_m = ground.DistanceTo(place.at.x, place.at.z);
    if (distance_m <= place.radius_m + more_m) least_m = std::min(least_m.value_or(distance_m), distance_m);
  }
  return least_m;
}

const TilePart* TileStore::PartOf(BodyId body) const {
  for (const std::uint32_t tile : here_) {
    const std::vector<TilePart>& parts = known_[tile].tile->parts;
    const auto found = std::ranges::lower_bound(parts, body, {}, [](const TilePart& part) { return part.body.id; });
    if (found != parts.end() && found->body.id == body) return &*found;
  }
  return nullptr;
}

// --- Which tiles.

void TileStore::Choose(TimePoint now, WorkBudget& budget) {
  choose_ = false;
  choose_at_.reset();
  chosen_for_ = places_;
  DropFar();
  std::vector<std::pair<double, std::uint32_t>> wanted;
  for (std::uint32_t tile = 0; tile < known_.size(); ++tile) {
    const std::optional<double> distance_m = DistanceTo(tile, 0);
    Known& known = known_[tile];
    if (!distance_m || known.tile != nullptr) continue;
    if (known.not_before > now) {
      choose_at_ = std::min(choose_at_.value_or(known.not_before), known.not_before);
      continue;
    }
    wanted.emplace_back(*distance_m, tile);
  }
  budget.Spend(std::ssize(known_) / kTilesLookedAtAUnit);
  const std::size_t count = std::min(wanted.size(), replication::kMaxTileWishes);
  std::ranges::partial_sort(wanted, wanted.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<Fetch> before = std::exchange(under_way_, {});
  for (std::size_t i = 0; i < count; ++i) {
    const auto same = std::ranges::find(before, wanted[i].second, &Fetch::tile);
    under_way_.push_back(same != before.end() ? std::move(*same) : Begin(wanted[i].second));
  }
}

void TileStore::DropFar() {
  std::erase_if(here_, [&](std::uint32_t tile) {
    if (DistanceTo(tile, kKeepEdges * index_->edge_m)) return false;
    bytes_here_ -= EntryOf(tile).bytes;
    std::shared_ptr<const Tile> gone = std::exchange(known_[tile].tile, nullptr);
    if (std::erase(came_, tile) == 0) gone_.emplace_back(tile, std::move(gone));
    return true;
  });
}

// --- How they come.

std::string TileStore::FileOf(std::uint32_t tile) const {
  return TextOf(FilePath(cache_dir_) / absl::StrCat(HexOf(EntryOf(tile).sha256), ".tile"));
}

TileStore::Fetch TileStore::Begin(std::uint32_t tile) const {
  Fetch fetch{.tile = tile};
  if (cache_dir_.empty() || known_[tile].failures > 0) return fetch;
  fetch.kept.open(FilePath(FileOf(tile)), std::ios::binary | std::ios::ate);
  const std::int64_t size = fetch.kept ? static_cast<std::int64_t>(fetch.kept.tellg()) : 0;
  fetch.from_folder = size == static_cast<std::int64_t>(EntryOf(tile).bytes + kKeptHeadBytes);
  if (fetch.from_folder) fetch.kept.seekg(static_cast<std::streamoff>(kKeptHeadBytes));
  return fetch;
}

void TileStore::ReadKept(Fetch& fetch, WorkBudget& budget) {
  const std::uint64_t total = EntryOf(fetch.tile).bytes;
  while (fetch.from_folder && fetch.bytes.size() < total && budget.left()) {
    const std::size_t begin = fetch.bytes.size();
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(kTileAtOnce_bytes, total - begin));
    fetch.bytes.resize(begin + size);
    fetch.kept.read(reinterpret_cast<char*>(fetch.bytes.data() + begin), static_cast<std::streamsize>(size));
    budget.Spend(static_cast<std::int64_t>(size) / kTileReadAUnit_bytes);
    if (!fetch.kept) AskRegions(fetch);
  }
}

// The folder's file is none.
void TileStore::AskRegions(Fetch& fetch) {
  fetch.from_folder = false;
  fetch.kept.close();
  fetch.unpacker.reset();
  fetch.bytes.clear();
  fetch.summed = 0;
  (void)fetch.sum->Finish();
}

std::vector<TileStore::Wish> TileStore::Wishes() const {
  std::vector<Wish> wishes;
  for (const Fetch& fetch : under_way_) {
    if (!fetch.from_folder && !IsWhole(fetch)) wishes.push_back({fetch.tile, fetch.bytes.size()});
  }
  return wishes;
}

bool TileStore::Take(const replication::TileChunk& chunk) {
  const auto fetch = std::ranges::find(under_way_, chunk.tile, &Fetch::tile);
  if (fetch == under_way_.end() || fetch->from_folder) return false;
  std::vector<std::uint8_t>& bytes = fetch->bytes;
  const std::uint64_t end = chunk.offset + chunk.bytes.size();
  // One that is there already, would leave a gap or is of another tile is nothing new.
  if (chunk.offset > bytes.size() || end <= bytes.size() || end > EntryOf(chunk.tile).bytes) return false;
  if (bytes.empty()) bytes.reserve(static_cast<std::size_t>(EntryOf(chunk.tile).bytes));
  const auto fresh = chunk.bytes.subspan(static_cast<std::size_t>(bytes.size() - chunk.offset));
  bytes.insert(bytes.end(), fresh.begin(), fresh.end());
  return true;
}

void TileStore::Work(TimePoint now, WorkBudget& budget) {
  if (choose_ || (choose_at_ && *choose_at_ <= now)) Choose(now, budget);
  if (keeper_ != nullptr) {
    if (!keeper_->Go(budget)) return;
    keeper_.reset();
  }
  for (Fetch& fetch : under_way_) ReadKept(fetch, budget);
  while (keeper_ == nullptr && budget.left()) {
    const auto whole = std::ranges::find_if(under_way_, [this](const Fetch& fetch) { return IsWhole(fetch); });
    if (whole == under_way_.end() || !Read(now, *whole, budget)) return;
    under_way_.erase(whole);
    choose_ = true;
  }
}

bool TileStore::Read(TimePoint now, Fetch& fetch, WorkBudget& budget) {
  while (fetch.summed < fetch.bytes.size()) {
    if (!budget.left()) return false;
    const std::size_t size = std::min(kTileAtOnce_bytes, fetch.bytes.size() - fetch.summed);
    fetch.sum->Add(std::span(fetch.bytes).subspan(fetch.summed, size));
    fetch.summed += size;
    budget.Spend(static_cast<std::int64_t>(size) / kTileSummedAUnit_bytes);
  }
  if (fetch.unpacker == nullptr) {
    if (fetch.sum->Finish() != EntryOf(fetch.tile).sha256) {
      Failed(now, fetch, "is not the one that the scene lists");
      return true;
    }
    fetch.unpacker = std::make_unique<TileUnpacker>(fetch.bytes, *index_, *scene_);
  }
  const std::int64_t units = std::max<std::int64_t>(budget.units_left(), 1);
  const bool over = fetch.unpacker->Go(static_cast<std::size_t>(units * kTileUnpackedAUnit_bytes));
  budget.Spend(over ? std::min(units, std::ssize(fetch.bytes) / kTileUnpackedAUnit_bytes) : units);
  if (!over) return false;
  auto tile = fetch.unpacker->Take();
  if (!tile.ok()) {
    Failed(now, fetch, std::string(tile.status().message()));
    return true;
  }
  Known& known = known_[fetch.tile];
  known.tile = *std::move(tile);
  known.failures = 0;
  here_.push_back(fetch.tile);
  came_.push_back(fetch.tile);
  bytes_here_ += fetch.bytes.size();
  fetch.unpacker.reset();
  if (!fetch.from_folder && !cache_dir_.empty()) {
    keeper_ = std::make_unique<SceneKeeper>(FileOf(fetch.tile), std::move(fetch.bytes), EntryOf(fetch.tile).sha256);
  }
  return true;
}

// A tile that the folder kept wrong is fetched at once; one that regions sent wrong is asked for again later.
void TileStore::Failed(TimePoint now, Fetch& fetch, const std::string& why) {
  Known& known = known_[fetch.tile];
  const std::uint32_t shift = std::min<std::uint32_t>(known.failures, 6);
  ++known.failures;
  last_damage_ = absl::StrCat("tile ", fetch.tile, ": ", why);
  if (fetch.from_folder) return;
  ++damaged_;
  known.not_before = now + std::min<std::chrono::milliseconds>(kTryAgain * (1 << shift), kTryAgainAtMost);
}

}  // namespace tessera::client
