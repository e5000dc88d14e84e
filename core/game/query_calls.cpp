#include "core/game/query_calls.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/game/arguments.h"
#include "core/game/question.h"
#include "core/world/limits.h"
#include "core/world/query.h"
#include "core/world/utf8.h"

namespace tessera::game {
namespace {

using QueryFields = std::span<const tessera_game_field>;

std::string_view FieldName(const tessera_game_field& field) { return {field.name, field.name_bytes}; }
bool Asks(std::uint32_t function) {
  return function == kWorldAskRay || function == kWorldAskSweep || function == kWorldAskOverlap;
}

// Reads the arguments of one query; what is wrong is named as game code wrote it: "ray: `options.layers` must be ...".
class QueryReader {
 public:
  QueryReader(const Function& function, const tessera_game_call& call) : function_(function), call_(call) {}

  absl::StatusOr<BodyQuery> Read(CallArguments arguments) {
    BodyQuery query;
    const bool still = function_.number == kWorldOverlap || function_.number == kWorldAskOverlap;
    const bool shaped = still || function_.number == kWorldSweep || function_.number == kWorldAskSweep;
    if (shaped) {
      if (absl::Status status = ReadShape(FieldsGiven(arguments[0]), query); !status.ok()) return status;
    }
    const CallArguments rest = arguments.subspan(shaped ? 1 : 0);
    query.from = VectorGiven(rest[0]);
    query.to = still ? query.from : VectorGiven(rest[1]);
    if (absl::Status status = CheckWay(query, still); !status.ok()) return status;
    query.most_hits = still ? kMaxQueryHits : function_.number == kWorldRayAll ? kUsualQueryHits : 1;
    if (call_.self != BodyId()) query.filter.ignored.push_back(call_.self);
    const std::size_t options = still ? 1 : 2;
    if (rest.size() > options && rest[options].type == TESSERA_GAME_FIELDS) {
      if (absl::Status status = ReadOptions(FieldsGiven(rest[options]), query); !status.ok()) return status;
    }
    return query;
  }
  // The query that was read, as it goes to other regions.
  Question ToAsk(BodyQuery query) const {
    Question question{std::move(query), kinds_, {}};
    if (!question.query.at_tick) question.query.at_tick = static_cast<double>(call_.tick.value());
    if (property_ != nullptr) {
      if (const auto value = FromInterface(*given_)) question.property.emplace_back(property_->name, *value);
    }
    return question;
  }
  // For the query that was read: by kind and property, which the physics does not know. Valid during the call.
  BodyPredicate accept() const {
    if (kinds_.empty() && !property_) return nullptr;
    return [this](BodyId id) {
      const Transaction& world = call_.transaction;
      const BodyDef* def = world.Find(id);
      if (def == nullptr) return false;
      if (!kinds_.empty() && std::ranges::find(kinds_, def->kind) == kinds_.end()) return false;
      return !property_ || ValueOf(world.world().scene().properties, def->properties, world.PropertiesOf(id),
                                   property_->name) == *value_;
    };
  }

 private:
  absl::Status Wrong(std::string_view argument, std::string_view what) const {
    return absl::InvalidArgumentError(
        absl::StrCat(ViewOf(function_.name), ": `", ViewOf(argument), "` ", ViewOf(what)));
  }

  absl::Status CheckWay(const BodyQuery& query, bool still) const {
    const auto near = [](Vec3d p) {
      return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= kMaxStatePosition_m;
    };
    if (!near(query.from)) return Wrong(still ? "at" : "from", absl::StrCat("is beyond ", kMaxStatePosition_m, " m"));
    if (still) return absl::OkStatus();
    if (!near(query.to)) return Wrong("to", absl::StrCat("is beyond ", kMaxStatePosition_m, " m"));
    const double length = Length(query.to - query.from);
    if (length == 0) return Wrong("to", "is the same point as `from`");
    if (length > kMaxQueryLength_m) {
      return Wrong("to", absl::StrCat("must be within ", kMaxQueryLength_m, " m of `from`, got ", length));
    }
    return absl::OkStatus();
  }

  absl::Status ReadExtent(const tessera_game_field& field, double* extent) const {
    const std::string argument = absl::StrCat("shape.", ViewOf(FieldName(field)));
    if (!IsNumber(field.value)) return Wrong(argument, "must be a number");
    *extent = NumberGiven(field.value);
    // Not <: what is not a number fails, too.
    if (!(*extent >= kMinQueryExtent_m && *extent <= kMaxQueryExtent_m)) return Wrong(argument, Range());
    return absl::OkStatus();
  }
  static std::string Range() { return absl::StrCat("must be ", kMinQueryExtent_m, " to ", kMaxQueryExtent_m, " m"); }

  absl::Status ReadShape(QueryFields fields, BodyQuery& query) const {
    std::optional<double> radius, half_height;
    std::optional<Vec3d> half_extents;
    for (const tessera_game_field& field : fields) {
      const std::string_view name = FieldName(field);
      if (name == "radius" || name == "half_height") {
        double& extent = (name == "radius" ? radius : half_height).emplace();
        if (absl::Status status = ReadExtent(field, &extent); !status.ok()) return status;
      } else if (name == "half_extents") {
        if (field.value.type != TESSERA_GAME_VECTOR) return Wrong("shape.half_extents", "must be a vector");
        const Vec3d half = half_extents.emplace(VectorGiven(field.value));
        for (const double axis : {half.x, half.y, half.z}) {
          if (!(axis >= kMinQueryExtent_m && axis <= kMaxQueryExtent_m)) return Wrong("shape.half_extents", Range());
        }
      } else if (name == "rotation") {
        if (field.value.type != TESSERA_GAME_ROTATION) return Wrong("shape.rotation", "must be a rotation");
        query.orientation = RotationGiven(field.value);
        if (!(std::abs(Length(query.orientation) - 1) <= kUnitTolerance)) return Wrong("shape.rotation", "is not unit");
        query.orientation = Normalized(query.orientation);
      } else {
        return Wrong(absl::StrCat("shape.", ViewOf(name)), kShapes);
      }
    }
    if (half_extents && !radius && !half_height) {
      query.shape = BoxShape{*half_extents};
    } else if (radius && !half_extents) {
      query.shape = half_height ? QueryShape(CapsuleShape{*radius, *half_height}) : QueryShape(SphereShape{*radius});
    } else {
      return Wrong("shape", kShapes);
    }
    return absl::OkStatus();
  }

  absl::Status ReadFlag(const tessera_game_field& field, bool* flag) const {
    if (field.value.type != TESSERA_GAME_FLAG) {
      return Wrong(absl::StrCat("options.", ViewOf(FieldName(field))), "must be true or false");
    }
    *flag = field.value.as.whole != 0;
    return absl::OkStatus();
  }

  // A value by itself counts as a list of one.
  static std::span<const tessera_game_value> ListIn(const tessera_game_value& value) {
    if (value.type == TESSERA_GAME_LIST) return {value.as.list, value.count};
    return {&value, 1};
  }

  absl::Status ReadLayers(const tessera_game_value& value, std::uint32_t* mask) const {
    const std::vector<std::string>& layers = call_.transaction.world().scene().layers;
    *mask = 0;
    for (const tessera_game_value& one : ListIn(value)) {
      if (one.type != TESSERA_GAME_TEXT) return Wrong("options.layers", "must be a layer's name or a list of names");
      const auto named = std::ranges::find(layers, TextGiven(one));
      if (named == layers.end()) {
        return Wrong("options.layers",
                     absl::StrCat("names \"", ViewOf(TextGiven(one).substr(0, kMaxLayerLength)),
                                  "\", which the scene does not; its layers: ", absl::StrJoin(layers, ", ")));
      }
      *mask |= 1u << static_cast<unsigned>(named - layers.begin());
    }
    return absl::OkStatus();
  }

  absl::Status ReadIgnored(const tessera_game_value& value, std::vector<BodyId>* ignored) const {
    const auto bodies = ListIn(value);
    if (bodies.size() > static_cast<std::size_t>(kMaxQueryHits)) {
      return Wrong("options.ignore", absl::StrCat("must be at most ", kMaxQueryHits, " bodies"));
    }
    for (const tessera_game_value& one : bodies) {
      if (one.type != TESSERA_GAME_BODY) return Wrong("options.ignore", "must be a body or a list of bodies");
      ignored->push_back(BodyId(one.as.id));
    }
    return absl::OkStatus();
  }

  absl::Status ReadKinds(const tessera_game_value& value) {
    const std::vector<std::string>& kinds = call_.transaction.world().scene().kinds;
    for (const tessera_game_value& one : ListIn(value)) {
      if (one.type != TESSERA_GAME_TEXT) return Wrong("options.kinds", "must be a kind or a list of kinds");
      const auto named = std::ranges::find(kinds, TextGiven(one));
      if (named == kinds.end() || named->empty()) {
        return Wrong("options.kinds", absl::StrCat("names \"", ViewOf(TextGiven(one).substr(0, kMaxKindLength)),
                                                   "\", which no body of the scene has"));
      }
      kinds_.push_back(static_cast<std::uint16_t>(named - kinds.begin()));
    }
    return absl::OkStatus();
  }

  absl::Status ReadProperty(const tessera_game_value& value) {
    if (value.type != TESSERA_GAME_TEXT) return Wrong("options.property", "must be the name of a property");
    const std::vector<PropertyDef>& properties = call_.transaction.world().scene().properties;
    const auto named = std::ranges::find(properties, TextGiven(value), &PropertyDef::name);
    if (named == properties.end()) {
      return Wrong("options.property", absl::StrCat("names \"", ViewOf(TextGiven(value).substr(0, kMaxNameLength)),
                                                    "\", which the scene does not declare"));
    }
    property_ = &*named;
    return absl::OkStatus();
  }

  absl::Status ReadLimit(const tessera_game_value& value, std::size_t* limit) const {
    if (value.type != TESSERA_GAME_WHOLE || value.as.whole < 1 || value.as.whole > kMaxQueryHits) {
      return Wrong("options.limit", absl::StrCat("must be a whole number, 1 to ", kMaxQueryHits));
    }
    *limit = static_cast<std::size_t>(value.as.whole);
    return absl::OkStatus();
  }

  absl::Status ReadTime(const tessera_game_value& value, std::optional<double>* tick) const {
    if (!IsNumber(value)) return Wrong("options.at_time", "must be a number, a tick and a part of one");
    const auto now = static_cast<double>(call_.tick.value());
    const double at = NumberGiven(value), most = kMaxLookBack_s * call_.transaction.world().scene().tick_rate_hz;
    // Not <: what is not a number fails, too.
    if (!(at >= now - most - kTimeTolerance && at <= now)) {
      return Wrong("options.at_time", absl::StrCat("must be from ", now - most, " to ", now, ", got ", at));
    }
    *tick = at;
    return absl::OkStatus();
  }

  absl::Status ReadOption(const tessera_game_field& field, BodyQuery& query, bool* self) {
    const std::string_view name = FieldName(field);
    const bool lists = function_.number == kWorldRayAll || function_.number == kWorldOverlap || Asks(function_.number);
    if (name == "dynamic") return ReadFlag(field, &query.filter.dynamic_bodies);
    if (name == "static") return ReadFlag(field, &query.filter.static_bodies);
    if (name == "triggers") return ReadFlag(field, &query.filter.triggers);
    if (name == "self") return ReadFlag(field, self);
    if (name == "at_time") return ReadTime(field.value, &query.at_tick);
    if (name == "layers") return ReadLayers(field.value, &query.filter.layers);
    if (name == "ignore") return ReadIgnored(field.value, &query.filter.ignored);
    if (name == "kinds") return ReadKinds(field.value);
    if (name == "property") return ReadProperty(field.value);
    if (name == "value") {
      given_ = &field.value;
      return absl::OkStatus();
    }
    if (name == "limit" && lists) return ReadLimit(field.value, &query.most_hits);
    return Wrong(absl::StrCat("options.", ViewOf(name.substr(0, kMaxLayerLength))),
                 absl::StrCat("is no option; there are: at_time, dynamic, ignore, kinds, layers",
                              lists ? ", limit" : "", ", property, self, static, triggers, value"));
  }

  absl::Status ReadOptions(QueryFields options, BodyQuery& query) {
    bool self = false;
    for (const tessera_game_field& option : options) {
      if (absl::Status status = ReadOption(option, query, &self); !status.ok()) return status;
    }
    if ((property_ == nullptr) != (given_ == nullptr)) {
      return Wrong(property_ == nullptr ? "options.property" : "options.value", "is missing");
    }
    if (property_ != nullptr) {
      value_ = PropertyFrom(*given_, *property_);
      if (!value_ || value_->index() != property_->initial.index()) {
        return Wrong("options.value", absl::StrCat("is not of the type of \"", property_->name, "\""));
      }
    }
    // The body that the callback is about was taken in first.
    if (self && call_.self != BodyId()) query.filter.ignored.erase(query.filter.ignored.begin());
    return absl::OkStatus();
  }

  static constexpr double kTimeTolerance = 1e-6;  // ticks; for rounding of what shown_time gave
  static constexpr std::string_view kShapes =
      "must have radius (a ball), radius and half_height (a capsule along y), or half_extents (a box), and may have "
      "rotation";
  const Function& function_;
  const tessera_game_call& call_;
  std::vector<std::uint16_t> kinds_;       // empty: all
  const PropertyDef* property_ = nullptr;  // null: whatever they have
  const tessera_game_value* given_ = nullptr;
  std::optional<PropertyValue> value_;
};

// --- Questions

// An answer costs at least this where it is made.
constexpr std::uint64_t kAskInstructions = 200;

// Reads what stands after the query's own arguments: values for the answer.
absl::StatusOr<std::vector<std::uint8_t>> ValuesIn(const Function& function, CallArguments arguments) {
  if (arguments.size() < function.parameters.size()) return std::vector<std::uint8_t>();
  const tessera_game_value& given = arguments.back();
  if (given.type == TESSERA_GAME_NOTHING) return std::vector<std::uint8_t>();
  const auto fields = FieldsFrom(given);
  if (!fields.ok()) return fields.status();
  return EncodeFields(*fields);
}

absl::Status AskRegions(tessera_game_call& call, const Function& function, CallArguments arguments) {
  const auto wrong = [&](std::string_view what) { return ArgumentFault(function.name, what); };
  call.instructions += kAskInstructions;
  const std::string_view name = TextGiven(arguments[0]);
  if (name.empty() || name.size() > kMaxQuestionNameBytes) return wrong("`name` must have 1 to 32 bytes");
  if (!IsUtf8(name)) return wrong("`name` is not UTF-8");
  QueryReader reader(function, call);
  absl::StatusOr<BodyQuery> query = reader.Read(arguments.subspan(1));
  if (!query.ok()) return query.status();
  auto values = ValuesIn(function, arguments);
  if (!values.ok()) return wrong(std::string(values.status().message()));
  const BodyId asker = call.self == BodyId() ? kInstanceBody : call.self;
  Transaction::Changes* const record = call.transaction.Own(asker);
  if (record == nullptr) {
    return absl::FailedPreconditionError(
        absl::StrCat(ViewOf(function.name), ": ",
                     asker == kInstanceBody ? "this region does not own the world's record"
                                            : absl::StrCat("this region does not own body ", asker.value()),
                     ", so nobody would get the answer"));
  }
  if (record->record.questions.size() >= kMaxQuestions) {
    return absl::ResourceExhaustedError(
        absl::StrCat(ViewOf(function.name), ": ", kMaxQuestions, " questions wait for their answers already"));
  }
  GameQuestion question;
  question.number = ++record->record.last_question;
  question.asked = call.tick;
  question.due = call.tick + AnswerTicks(call.transaction.world().HopsFor(*query));
  question.name = std::string(name);
  question.values = *std::move(values);
  question.query = EncodeQuestion(reader.ToAsk(*std::move(query)));
  record->record.questions.push_back(std::move(question));
  return absl::OkStatus();
}

// --- Results

tessera_game_field HitField(std::string_view name, tessera_game_value value) {
  return {name.data(), name.size(), value};
}

constexpr std::size_t kFieldsOfHit = 5;

// Writes the fields of a hit, ascending by name, from `fields` on.
tessera_game_value ValueOfHit(const QueryHit& hit, double length_m, tessera_game_field* fields) {
  fields[0] = HitField("body", BodyResult(hit.body));
  fields[1] = HitField("distance", ToInterface(GameValue(hit.fraction * length_m)));
  fields[2] = HitField("fraction", ToInterface(GameValue(hit.fraction)));
  fields[3] = HitField("normal", ToInterface(GameValue(hit.normal)));
  fields[4] = HitField("point", ToInterface(GameValue(hit.point)));
  tessera_game_value value{};
  value.type = TESSERA_GAME_FIELDS;
  value.count = kFieldsOfHit;
  value.as.fields = fields;
  return value;
}

tessera_game_value HitList(const std::vector<tessera_game_value>& values) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_LIST;
  value.count = static_cast<std::uint32_t>(values.size());
  value.as.list = values.data();
  return value;
}

tessera_game_value ValueOfHits(tessera_game_call& call, const Function& function, const BodyQuery& query,
                               const std::vector<QueryHit>& hits) {
  call.values.clear();
  if (function.number == kWorldOverlap) {
    for (const QueryHit& hit : hits) call.values.push_back(BodyResult(hit.body));
    return HitList(call.values);
  }
  const double length_m = Length(query.to - query.from);
  call.fields.assign(kFieldsOfHit * hits.size(), {});
  for (std::size_t i = 0; i < hits.size(); ++i) {
    call.values.push_back(ValueOfHit(hits[i], length_m, call.fields.data() + kFieldsOfHit * i));
  }
  if (function.number == kWorldRayAll) return HitList(call.values);
  return hits.empty() ? tessera_game_value{} : call.values.front();
}

}  // namespace

tessera_game_value HitsValue(const std::vector<QueryHit>& hits, double length_m,
                             std::vector<tessera_game_value>& values, std::vector<tessera_game_field>& fields) {
  values.clear();
  fields.assign(kFieldsOfHit * hits.size(), {});
  for (std::size_t i = 0; i < hits.size(); ++i) {
    values.push_back(ValueOfHit(hits[i], length_m, fields.data() + kFieldsOfHit * i));
  }
  return HitList(values);
}

absl::StatusOr<tessera_game_value> CallQuery(tessera_game_call& call, const Function& function,
                                             CallArguments arguments) {
  if (Asks(function.number)) {
    const absl::Status status = AskRegions(call, function, arguments);
    if (!status.ok()) return status;
    return tessera_game_value{};
  }
  QueryReader reader(function, call);
  absl::StatusOr<BodyQuery> query = reader.Read(arguments);
  if (!query.ok()) return query.status();
  query->most_work = call.budget - std::min(call.budget, call.instructions);
  const QueryResult result = call.transaction.world().FindBodies(*query, reader.accept());
  call.instructions += result.work;
  if (!result.complete) {
    call.instructions = std::max(call.instructions, call.budget + 1);  // the callback fails, whatever it does now
    return absl::ResourceExhaustedError(
        absl::StrCat(ViewOf(function.name), ": meets more than the callback's instructions can pay for"));
  }
  return ValueOfHits(call, function, *query, result.hits);
}

}  // namespace tessera::game
