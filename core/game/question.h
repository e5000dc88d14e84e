// Question: a query that a game has put to all regions, which goes wherever its asker goes until it is answered.
//
// All regions answer for one moment, so the answer does not depend on how long the question took; each names the bodies
// that it owned then. Thread rule: plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/value.h"
#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/properties.h"
#include "core/world/query.h"
#include "core/world/scene.h"

namespace tessera::game {

// Questions of one body, or of the world, that are not answered yet.
inline constexpr std::size_t kMaxQuestions = 8;
inline constexpr std::size_t kMaxQuestionNameBytes = 32;
// A query as it travels: 65 bodies that it leaves out, the value of a property, and the rest.
inline constexpr std::size_t kMaxQuestionBytes = 1'280;
// Hits of one region as they travel.
inline constexpr std::size_t kMaxAnswerBytes = 8 + 66 * 64;

// As a record keeps it.
struct GameQuestion {
  std::uint32_t number = 0;  // each question of a record has another one
  Tick asked, due;           // it is answered at `due`, or later where a region takes longer
  std::string name;
  std::vector<std::uint8_t> values;  // EncodeFields
  std::vector<std::uint8_t> query;   // EncodeQuestion
  friend bool operator==(const GameQuestion&, const GameQuestion&) = default;
};

// The query with what the physics does not know of its filter. It has a moment: BodyQuery::at_tick.
struct Question {
  BodyQuery query;
  std::vector<std::uint16_t> kinds;  // empty: all
  GameFields property;               // none, or one: bodies that have this value
};

// The bytes mean nothing without the scene, which has the kinds and the properties.
std::vector<std::uint8_t> EncodeQuestion(const Question& question);
// INVALID_ARGUMENT: "query: truncated", "query: is not finite", "query: an unknown kind" and so on.
absl::StatusOr<Question> DecodeQuestion(std::span<const std::uint8_t> bytes, const Scene& scene);

// Whether the filter takes a body with this definition and these changed properties.
bool Accepts(const Question& question, const Scene& scene, const BodyDef& def, const PropertySet& changed);

// Holds what one region knows, or all of them together.
struct Answer {
  std::vector<QueryHit> hits;  // ascending by (fraction, body)
  bool complete = true;
};
std::vector<std::uint8_t> EncodeAnswer(const Answer& answer);
absl::StatusOr<Answer> DecodeAnswer(std::span<const std::uint8_t> bytes);
// Adds the hits of another region; each body counts once, and `most_hits` stay.
void Merge(const Answer& other, std::size_t most_hits, Answer& answer);

// For a region so many borders away: a question and its answer each take as long as a message.
std::uint64_t AnswerTicks(std::uint32_t hops);

void Write(ByteWriter& out, const std::vector<GameQuestion>& questions);
// Leaves a failed reader, or questions that CheckQuestions refuses, where the bytes are not sound.
void Read(ByteReader& in, std::vector<GameQuestion>& questions);
// INVALID_ARGUMENT: "questions: numbers do not ascend", "questions: values: truncated" and so on. The queries in them
// are checked with the scene (DecodeQuestion).
absl::Status CheckQuestions(const std::vector<GameQuestion>& questions, std::uint32_t last_number);

}  // namespace tessera::game
