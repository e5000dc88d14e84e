#include "core/region/question_desk.h"

#include <algorithm>
#include <set>
#include <utility>

#include "core/physics/query/way.h"

namespace tessera::region {
namespace {

// Work for other regions' questions, and for this one's, in a tick and in one question: as a game's callbacks have.
constexpr std::uint64_t kMostWorkPerTick = 100'000, kMostWorkPerQuestion = 20'000;
// A region that has not answered is asked again after so many ticks.
constexpr std::uint64_t kAskAgainTicks = 10;
// A body may be so far outside of its owner's cells, m: its own extent, and what it moves until it is handed over.
constexpr double kBeyondCells_m = 8;

double Extent(const QueryShape& shape) {
  if (const auto* sphere = std::get_if<SphereShape>(&shape)) return sphere->radius_m;
  if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) return capsule->radius_m + capsule->half_height_m;
  if (const auto* box = std::get_if<BoxShape>(&shape)) return Length(box->half_extents_m);
  return 0;
}

}  // namespace

// By the x-z plane. Cells at the edge of the map reach on for ever.
std::vector<RegionId> QuestionDesk::Touched(const BodyQuery& query) const {
  const PartitionMap& map = neighborhood_.map();
  const Rect& bounds = map.bounds();
  const double more = kBeyondCells_m + Extent(query.shape);
  constexpr double kFar_m = 1e9;
  const physics::Way way{{query.from.x, 0, query.from.z}, {query.to.x - query.from.x, 0, query.to.z - query.from.z}};
  std::set<RegionId> touched;
  for (const Cell& cell : map.cells()) {
    const Rect& area = cell.area;
    const Vec3d low{area.min_x <= bounds.min_x ? -kFar_m : area.min_x - more, -1,
                    area.min_z <= bounds.min_z ? -kFar_m : area.min_z - more};
    const Vec3d high{area.max_x >= bounds.max_x ? kFar_m : area.max_x + more, 1,
                     area.max_z >= bounds.max_z ? kFar_m : area.max_z + more};
    if (!way.PartIn({low, high})) continue;
    touched.insert(cell.owner);
    if (cell.from != RegionId()) touched.insert(cell.from);
  }
  touched.erase(neighborhood_.self());
  return {touched.begin(), touched.end()};
}

std::uint32_t QuestionDesk::HopsFor(const BodyQuery& query) const {
  routes_.Adopt(neighborhood_.map());
  std::uint32_t hops = 0;
  for (const RegionId region : Touched(query)) {
    hops = std::max(hops, routes_.Distance(neighborhood_.self(), region).value_or(1));
  }
  return hops;
}

PropertySet QuestionDesk::ChangedOf(BodyId id) const {
  const KeptRecord* record = records_.Find(id);
  const std::vector<std::uint8_t>* bytes = record != nullptr ? record->bytes.get() : shared_.Find(id);
  if (bytes == nullptr || bytes->empty()) return {};
  return PropertySet::Decode(*bytes, catalog_.scene().properties).value_or(PropertySet());
}

game::Answer QuestionDesk::AnswerHere(game::Question question, QueryScope scope, Tick now) {
  if (worked_at_ != now) worked_ = 0;
  worked_at_ = now;
  game::Answer answer;
  if (worked_ >= kMostWorkPerTick) {
    answer.complete = false;
    return answer;
  }
  question.query.scope = scope;
  question.query.most_work = kMostWorkPerQuestion;
  BodyPredicate accept;
  if (!question.kinds.empty() || !question.property.empty()) {
    accept = [&](BodyId id) {
      const std::ptrdiff_t place = bodies_.PlaceOf(id);
      const BodyDef* def = place >= 0 ? &bodies_.DefAt(static_cast<std::size_t>(place)) : catalog_.Find(id);
      return def != nullptr && game::Accepts(question, catalog_.scene(), *def, ChangedOf(id));
    };
  }
  QueryResult result = bodies_.world().FindBodies(question.query, accept);
  worked_ += result.work;
  answer.complete = result.complete && result.known;
  answer.hits = std::move(result.hits);
  return answer;
}

QuestionDesk::Open QuestionDesk::OpenAnew(const game::GameQuestion& question, Tick now) {
  Open open;
  open.next = now;
  auto decoded = game::DecodeQuestion(question.query, catalog_.scene());
  if (!decoded.ok()) return open;  // CheckRecord lets none in
  open.most_hits = decoded->query.most_hits;
  for (const RegionId region : Touched(decoded->query)) open.regions[region] = std::nullopt;
  open.regions[neighborhood_.self()] = AnswerHere(*std::move(decoded), QueryScope::kOwnedAndFixed, now);
  return open;
}

std::vector<MessagePacket> QuestionDesk::Ask(Tick now) {
  std::vector<MessagePacket> packets;
  if (records_.asking().empty() && open_.empty()) return packets;
  std::map<Key, Open> before = std::exchange(open_, {});
  for (const BodyId asker : records_.asking()) {
    const KeptRecord* const record = records_.Find(asker);
    for (const game::GameQuestion& question : record->game.questions) {
      const Key key(asker, question.number, question.asked);
      auto known = before.extract(key);
      Open& open =
          open_.emplace(key, known.empty() ? OpenAnew(question, now) : std::move(known.mapped())).first->second;
      if (open.next > now) continue;
      open.next = now + kAskAgainTicks;
      for (const auto& [region, answer] : open.regions) {
        if (answer) continue;
        MessagePacket packet;
        packet.kind = PacketKind::kQuestion;
        packet.from = asker;
        packet.number = question.number;
        packet.origin = neighborhood_.self();
        packet.via = region;
        packet.sent = now;
        packet.made = question.asked;
        packet.made_in = neighborhood_.self();
        packet.properties = question.query;
        packets.push_back(std::move(packet));
      }
    }
  }
  return packets;
}

std::optional<MessagePacket> QuestionDesk::Take(const MessagePacket& packet, Tick now) {
  if (packet.kind == PacketKind::kAnswer) {
    const auto open = open_.find(Key(packet.from, static_cast<std::uint32_t>(packet.number), packet.made));
    if (open == open_.end()) return std::nullopt;
    const auto region = open->second.regions.find(packet.origin);
    auto answer = game::DecodeAnswer(packet.properties);
    if (region != open->second.regions.end() && !region->second && answer.ok()) region->second = *std::move(answer);
    return std::nullopt;
  }
  auto question = game::DecodeQuestion(packet.properties, catalog_.scene());
  if (!question.ok()) return std::nullopt;
  // A region that is behind, because a link has been down, is asked again.
  if (*question->query.at_tick > static_cast<double>(now.value()) - 1) return std::nullopt;
  MessagePacket answer;
  answer.kind = PacketKind::kAnswer;
  answer.from = packet.from;
  answer.number = packet.number;
  answer.origin = neighborhood_.self();
  answer.via = packet.origin;
  answer.sent = now;
  answer.made = packet.made;
  answer.made_in = neighborhood_.self();
  answer.properties = game::EncodeAnswer(AnswerHere(*std::move(question), QueryScope::kOwned, now));
  return answer;
}

std::optional<game::Answer> QuestionDesk::AnswerTo(BodyId asker, const game::GameQuestion& question, Tick now) const {
  const auto open = open_.find(Key(asker, question.number, question.asked));
  const bool over = now >= question.asked + static_cast<std::uint64_t>(catalog_.scene().tick_rate_hz);
  game::Answer all;
  if (open == open_.end()) {
    if (!over) return std::nullopt;
    all.complete = false;
    return all;
  }
  for (const auto& [region, answer] : open->second.regions) {
    if (!answer && !over) return std::nullopt;
    if (!answer) all.complete = false;
  }
  for (const auto& [region, answer] : open->second.regions) {
    if (answer) Merge(*answer, open->second.most_hits, all);
  }
  return all;
}

}  // namespace tessera::region
