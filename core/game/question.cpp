#include "core/game/question.h"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <variant>

#include "absl/strings/str_cat.h"
#include "core/game/mail.h"
#include "core/game/query_calls.h"
#include "core/world/limits.h"

namespace tessera::game {
namespace {

enum class ProbeKind : std::uint8_t { kPoint, kSphere, kCapsule, kBox };
enum : std::uint8_t { kStatic = 1, kDynamic = 2, kTriggers = 4, kAllScopes = 7 };

absl::Status BadQuery(absl::string_view what) { return absl::InvalidArgumentError(absl::StrCat("query: ", what)); }
absl::Status BadQuestions(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("questions: ", what));
}

void WriteProbe(ByteWriter& out, const QueryShape& shape) {
  out.U8(static_cast<std::uint8_t>(shape.index()));
  if (const auto* sphere = std::get_if<SphereShape>(&shape)) out.F64(sphere->radius_m);
  if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) {
    out.F64(capsule->radius_m);
    out.F64(capsule->half_height_m);
  }
  if (const auto* box = std::get_if<BoxShape>(&shape)) out.V(box->half_extents_m);
}

QueryShape ReadProbe(ByteReader& in) {
  switch (static_cast<ProbeKind>(in.U8())) {
    case ProbeKind::kPoint:
      return PointProbe{};
    case ProbeKind::kSphere:
      return SphereShape{in.F64()};
    case ProbeKind::kCapsule: {
      const double radius = in.F64();
      return CapsuleShape{radius, in.F64()};
    }
    case ProbeKind::kBox:
      return BoxShape{in.V3d()};
  }
  in.Fail("an unknown shape");
  return PointProbe{};
}

bool IsExtent(double extent) { return extent >= kMinQueryExtent_m && extent <= kMaxQueryExtent_m; }

bool IsProbe(const QueryShape& shape) {
  if (const auto* sphere = std::get_if<SphereShape>(&shape)) return IsExtent(sphere->radius_m);
  if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) {
    return IsExtent(capsule->radius_m) && IsExtent(capsule->half_height_m);
  }
  if (const auto* box = std::get_if<BoxShape>(&shape)) {
    const Vec3d half = box->half_extents_m;
    return IsExtent(half.x) && IsExtent(half.y) && IsExtent(half.z);
  }
  return true;
}

bool IsQueryPlace(Vec3d p) {
  // Not >: what is not a number fails, too.
  return std::abs(p.x) <= kMaxStatePosition_m && std::abs(p.y) <= kMaxStatePosition_m &&
         std::abs(p.z) <= kMaxStatePosition_m;
}

absl::Status CheckQuery(const BodyQuery& query) {
  if (!IsProbe(query.shape)) return BadQuery("an extent is out of range");
  if (!(std::abs(Length(query.orientation) - 1) <= kUnitTolerance)) return BadQuery("a rotation is not unit");
  if (!IsQueryPlace(query.from) || !IsQueryPlace(query.to)) return BadQuery("a place is not finite, or beyond limits");
  if (Length(query.to - query.from) > kMaxQueryLength_m * (1 + 1e-9)) return BadQuery("the way is too long");
  if (query.most_hits < 1 || query.most_hits > static_cast<std::size_t>(kMaxQueryHits)) {
    return BadQuery("number of hits");
  }
  if (!(*query.at_tick >= 0 && *query.at_tick <= 1e15)) return BadQuery("its moment is out of range");
  return absl::OkStatus();
}

bool IsHit(const QueryHit& hit) {
  return hit.fraction >= 0 && hit.fraction <= 1 && IsQueryPlace(hit.point) && IsFinite(hit.normal) &&
         Length(hit.normal) <= 1 + kUnitTolerance;
}

bool HitPrecedes(const QueryHit& a, const QueryHit& b) {
  return a.fraction != b.fraction ? a.fraction < b.fraction : a.body < b.body;
}

}  // namespace

std::vector<std::uint8_t> EncodeQuestion(const Question& question) {
  const BodyQuery& query = question.query;
  const QueryFilter& filter = query.filter;
  ByteWriter out;
  WriteProbe(out, query.shape);
  if (!std::holds_alternative<PointProbe>(query.shape)) out.Q(query.orientation);
  out.V(query.from);
  out.V(query.to);
  out.Varint(filter.layers);
  out.U8(static_cast<std::uint8_t>((filter.static_bodies ? kStatic : 0) | (filter.dynamic_bodies ? kDynamic : 0) |
                                   (filter.triggers ? kTriggers : 0)));
  out.Varint(filter.ignored.size());
  for (const BodyId id : filter.ignored) out.Varint(id.value());
  out.Varint(query.most_hits);
  out.F64(query.at_tick.value_or(0));
  out.Varint(question.kinds.size());
  for (const std::uint16_t kind : question.kinds) out.Varint(kind);
  const auto property = EncodeFields(question.property);
  out.Block(property.ok() ? *property : std::vector<std::uint8_t>());
  return out.Take();
}

absl::StatusOr<Question> DecodeQuestion(std::span<const std::uint8_t> bytes, const Scene& scene) {
  Question question;
  BodyQuery& query = question.query;
  QueryFilter& filter = query.filter;
  ByteReader in(bytes);
  in.Field("query");
  query.shape = ReadProbe(in);
  if (!std::holds_alternative<PointProbe>(query.shape)) query.orientation = in.Q();
  query.from = in.V3d();
  query.to = in.V3d();
  filter.layers = in.Varint32();
  const std::uint8_t flags = in.U8();
  if (flags > kAllScopes) in.Fail("unknown flags");
  filter.static_bodies = (flags & kStatic) != 0;
  filter.dynamic_bodies = (flags & kDynamic) != 0;
  filter.triggers = (flags & kTriggers) != 0;
  filter.ignored.resize(in.Count(1));
  if (filter.ignored.size() > static_cast<std::size_t>(kMaxQueryHits) + 1) in.Fail("too many bodies are ignored");
  for (BodyId& id : filter.ignored) id = BodyId(in.Varint());
  query.most_hits = in.Varint32();
  query.at_tick = in.F64();
  question.kinds.resize(in.Count(1));
  if (question.kinds.size() > static_cast<std::size_t>(kMaxQueryHits)) in.Fail("too many kinds");
  for (std::uint16_t& kind : question.kinds) {
    const std::uint64_t number = in.Varint();
    if (number >= scene.kinds.size()) in.Fail("an unknown kind");
    kind = static_cast<std::uint16_t>(number);
  }
  const auto property = in.Block(kMaxFieldBytes);
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (in.remaining() != 0) return BadQuery("trailing bytes");
  if (absl::Status status = CheckQuery(query); !status.ok()) return status;
  auto fields = DecodeFields(property);
  if (!fields.ok()) return fields.status();
  question.property = *std::move(fields);
  if (question.property.size() > 1) return BadQuery("more than one property");
  for (const auto& [name, value] : question.property) {
    const auto def = std::ranges::find(scene.properties, name, &PropertyDef::name);
    if (def == scene.properties.end()) return BadQuery("a property that the scene does not declare");
    const auto wanted = PropertyFrom(ToInterface(value), *def);
    if (!wanted || wanted->index() != def->initial.index()) return BadQuery("a value of another type");
  }
  return question;
}

bool Accepts(const Question& question, const Scene& scene, const BodyDef& def, const PropertySet& changed) {
  if (!question.kinds.empty() && std::ranges::find(question.kinds, def.kind) == question.kinds.end()) return false;
  for (const auto& [name, value] : question.property) {
    const auto declared = std::ranges::find(scene.properties, name, &PropertyDef::name);
    if (ValueOf(scene.properties, def.properties, changed, name) != PropertyFrom(ToInterface(value), *declared)) {
      return false;
    }
  }
  return true;
}

std::vector<std::uint8_t> EncodeAnswer(const Answer& answer) {
  ByteWriter out;
  out.U8(answer.complete ? 1 : 0);
  out.Varint(answer.hits.size());
  for (const QueryHit& hit : answer.hits) {
    out.Varint(hit.body.value());
    out.F64(hit.fraction);
    out.V(hit.point);
    out.V(hit.normal);
  }
  return out.Take();
}

absl::StatusOr<Answer> DecodeAnswer(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kMinHitBytes = 1 + 8 + 24 + 24;
  Answer answer;
  ByteReader in(bytes);
  in.Field("answer");
  const std::uint8_t complete = in.U8();
  if (complete > 1) in.Fail("unknown flags");
  answer.complete = complete == 1;
  answer.hits.resize(in.Count(kMinHitBytes));
  if (answer.hits.size() > static_cast<std::size_t>(kMaxQueryHits)) in.Fail("too many hits");
  for (QueryHit& hit : answer.hits) {
    hit.body = BodyId(in.Varint());
    hit.fraction = in.F64();
    hit.point = in.V3d();
    hit.normal = in.V3d();
    if (in.ok() && !IsHit(hit)) in.Fail("a hit that is none");
  }
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (in.remaining() != 0) return absl::InvalidArgumentError("answer: trailing bytes");
  if (!std::ranges::is_sorted(answer.hits, HitPrecedes)) return absl::InvalidArgumentError("answer: out of order");
  return answer;
}

void Merge(const Answer& other, std::size_t most_hits, Answer& answer) {
  answer.complete = answer.complete && other.complete;
  answer.hits.insert(answer.hits.end(), other.hits.begin(), other.hits.end());
  std::ranges::sort(answer.hits, HitPrecedes);
  std::vector<QueryHit> each;
  for (const QueryHit& hit : answer.hits) {
    if (each.size() == most_hits) break;
    if (std::ranges::find(each, hit.body, &QueryHit::body) == each.end()) each.push_back(hit);
  }
  answer.hits = std::move(each);
}

std::uint64_t AnswerTicks(std::uint32_t hops) { return hops == 0 ? 2 : 2 * DeliveryTicks(hops); }

void Write(ByteWriter& out, const std::vector<GameQuestion>& questions) {
  out.Varint(questions.size());
  for (const GameQuestion& question : questions) {
    out.Varint(question.number);
    out.Varint(question.asked.value());
    out.Varint(question.due.value());
    out.Block(std::string_view(question.name));
    out.Block(question.values);
    out.Block(question.query);
  }
}

void Read(ByteReader& in, std::vector<GameQuestion>& questions) {
  const std::uint64_t count = in.Varint();
  if (count > kMaxQuestions) in.Fail("more than 8 questions");
  for (std::uint64_t i = 0; in.ok() && i < count; ++i) {
    GameQuestion& question = questions.emplace_back();
    question.number = in.Varint32();
    question.asked = Tick(in.Varint());
    question.due = Tick(in.Varint());
    const auto name = in.Block(kMaxQuestionNameBytes);
    question.name.assign(name.begin(), name.end());
    const auto values = in.Block(kMaxFieldBytes);
    question.values.assign(values.begin(), values.end());
    const auto query = in.Block(kMaxQuestionBytes);
    question.query.assign(query.begin(), query.end());
  }
}

absl::Status CheckQuestions(const std::vector<GameQuestion>& questions, std::uint32_t last_number) {
  if (questions.size() > kMaxQuestions) return BadQuestions("more than 8");
  std::uint32_t last = 0;
  for (const GameQuestion& question : questions) {
    if (question.number <= last || question.number > last_number) return BadQuestions("numbers do not ascend");
    last = question.number;
    if (question.due < question.asked) return BadQuestions("one is due before it was asked");
    if (question.name.size() > kMaxQuestionNameBytes) return BadQuestions("a name is too long");
    if (question.query.size() > kMaxQuestionBytes) return BadQuestions("a query is too long");
    if (const auto fields = DecodeFields(question.values); !fields.ok()) return BadQuestions(fields.status().message());
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
