#include "control_plane/cluster/game_messages.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "control_plane/control_settings.h"
#include "control_plane/game_fields.h"
#include "control_plane/instance_record.h"
#include "control_plane/life.h"
#include "control_plane/one_line.h"
#include "core/game/settings.h"

namespace tessera::control {
namespace {

constexpr char kSentMessages[] = "message/";

std::string MessageKey(std::uint64_t instance, std::uint64_t number) {
  return absl::StrCat(kSentMessages, instance, "/", absl::Dec(number, absl::kZeroPad20));
}

// The body that a message is for; 0: the world. NOT_FOUND names the field.
absl::StatusOr<BodyId> TargetOf(const InstanceEntry& instance, const v1::SendToGameRequest& request) {
  const records::Instance& record = instance.record;
  const auto has = [&](BodyId body) { return HasBody(record, instance.players, body); };
  switch (request.target_case()) {
    case v1::SendToGameRequest::kBody:
      if (request.body() == 0 || !has(BodyId(request.body()))) {
        return absl::NotFoundError(absl::StrCat("body: ", record.id(), " has no body ", request.body(), " that moves"));
      }
      return BodyId(request.body());
    case v1::SendToGameRequest::kPlayer: {
      const BodyId body = PlayerBodyId(PlayerNumber(request.player()));
      if (request.player() == 0 || !IsPlayerBody(body) || !has(body)) {
        return absl::NotFoundError(absl::StrCat("player: ", record.id(), " has no player ", request.player()));
      }
      return body;
    }
    case v1::SendToGameRequest::TARGET_NOT_SET:
      break;
  }
  return BodyId();
}

absl::StatusOr<records::GameMessage> Checked(const InstanceEntry& instance, const v1::SendToGameRequest& request) {
  if (request.request_id().empty() || request.request_id().size() > kMaxRequestIdBytes) {
    return absl::InvalidArgumentError(absl::StrCat("request_id: must have 1 to ", kMaxRequestIdBytes, " bytes"));
  }
  if (request.name().empty() || request.name().size() > game::kMaxMessageNameBytes) {
    return absl::InvalidArgumentError(absl::StrCat("name: must have 1 to ", game::kMaxMessageNameBytes, " bytes"));
  }
  const auto target = TargetOf(instance, request);
  if (!target.ok()) return target.status();
  const auto values = EncodeGameFields(request.values());
  if (!values.ok()) return values.status();
  records::GameMessage message;
  message.set_request_id(request.request_id());
  message.set_body(target->value());
  message.set_name(request.name());
  message.set_values(values->data(), values->size());
  return message;
}

}  // namespace

absl::Status GameMessages::Load() {
  const auto entries = state_.ListStored(kSentMessages);
  if (!entries.ok()) return entries.status();
  for (const StoreEntry& entry : *entries) {
    Sent sent;
    sent.revision = entry.revision;
    const std::vector<std::string> parts = absl::StrSplit(entry.key, '/');
    std::uint64_t instance = 0;
    if (parts.size() != 3 || !absl::SimpleAtoi(parts[1], &instance) || !ReadRecord(entry, sent.record)) {
      if (absl::Status status = state_.SetAside(entry); !status.ok()) return status;
      continue;
    }
    Box& box = boxes_[instance];
    box.by_request[sent.record.request_id()] = sent.record.number();
    if (!sent.record.answered()) ++box.waiting;
    const std::uint64_t number = sent.record.number();
    box.sent[number] = std::move(sent);
  }
  std::vector<std::uint64_t> orphans;
  for (const auto& [number, box] : boxes_) {
    if (!state_.instances().contains(number) && state_.set_aside().empty()) orphans.push_back(number);
  }
  for (const std::uint64_t number : orphans) Forget(number);
  for (InstanceEntry& instance : state_.EachInstance()) {
    const auto box = boxes_.find(instance.number);
    if (box != boxes_.end()) instance.game_messages_waiting = box->second.waiting;
  }
  return absl::OkStatus();
}

std::uint64_t GameMessages::Find(const InstanceEntry& instance, const std::string& request_id) const {
  const auto box = boxes_.find(instance.number);
  if (box == boxes_.end()) return 0;
  const auto found = box->second.by_request.find(request_id);
  return found == box->second.by_request.end() ? 0 : found->second;
}

absl::StatusOr<std::uint64_t> GameMessages::Add(InstanceEntry& instance, const v1::SendToGameRequest& request,
                                                Now now) {
  auto checked = Checked(instance, request);
  if (!checked.ok()) return checked.status();
  Box& box = boxes_[instance.number];
  if (box.waiting >= kMaxGameMessages) {
    return absl::ResourceExhaustedError(
        absl::StrCat("id: ", box.waiting, " messages to ", instance.record.id(), " wait already"));
  }
  if (request.validate_only()) return 0;
  Sent sent{*std::move(checked), kAbsent};
  // Numbers go by the clock, so that they also ascend in a world that was imported with its records.
  const auto now_us =
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(now.unix_time).count());
  const std::uint64_t number = box.sent.empty() ? now_us : std::max(now_us, box.sent.rbegin()->first + 1);
  sent.record.set_number(number);
  *sent.record.mutable_time() = ToTimestamp(now.unix_time);
  std::vector<StoreOp> ops{PutOp(MessageKey(instance.number, number), sent.record.SerializeAsString(), kAbsent)};
  const auto oldest = box.sent.begin();
  const bool forgets = box.sent.size() >= kMaxGameRequestsKept && oldest->second.record.answered();
  if (forgets) ops.push_back(DeleteOp(MessageKey(instance.number, oldest->first), oldest->second.revision));
  const auto written = state_.WriteStored(ops);
  if (!written.ok()) return written.status();
  if (forgets) {
    box.by_request.erase(oldest->second.record.request_id());
    box.sent.erase(oldest);
  }
  sent.revision = *written;
  box.by_request[sent.record.request_id()] = number;
  box.sent.emplace(number, std::move(sent));
  instance.game_messages_waiting = ++box.waiting;
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
  return number;
}

std::optional<absl::Status> GameMessages::Outcome(const std::string& id, std::uint64_t number) const {
  const InstanceEntry* instance = state_.FindInstance(id);
  const auto gone = absl::AbortedError(absl::StrCat("id: ", OneLine(id, kMaxNameBytes), " does not run any more"));
  if (instance == nullptr) return gone;
  const auto box = boxes_.find(instance->number);
  if (box == boxes_.end()) return gone;
  const auto sent = box->second.sent.find(number);
  if (sent == box->second.sent.end()) return gone;
  const records::GameMessage& record = sent->second.record;
  if (record.answered()) {
    return record.refused().empty() ? absl::OkStatus()
                                    : absl::FailedPreconditionError(absl::StrCat("target: ", record.refused()));
  }
  return WantsWorkers(instance->record.state()) ? std::nullopt : std::optional<absl::Status>(gone);
}

// The content of an answered message is not needed any more.
void GameMessages::Answer(InstanceEntry& instance, Box& box, Sent& sent, const std::string& refused) {
  records::GameMessage answered;
  answered.set_number(sent.record.number());
  answered.set_request_id(sent.record.request_id());
  answered.set_answered(true);
  answered.set_refused(OneLine(refused, kMaxReasonBytes));
  const StoreOp op = PutOp(MessageKey(instance.number, answered.number()), answered.SerializeAsString(), sent.revision);
  const auto written = state_.WriteStored({&op, 1});
  if (!written.ok())
    return LogTrouble(state_, instance, "a message's answer cannot be stored for now", written.status());
  sent = {std::move(answered), *written};
  instance.game_messages_waiting = --box.waiting;
  state_.MarkOrders(instance);
  state_.MarkChanged(instance);
}

void GameMessages::TakeAnswers(InstanceEntry& instance, const v1::WorkerReport& report) {
  const auto box = boxes_.find(instance.number);
  if (box == boxes_.end()) return;
  for (const v1::BackendAnswer& answer : report.backend_answers()) {
    const auto sent = box->second.sent.find(answer.number());
    if (sent == box->second.sent.end() || sent->second.record.answered()) continue;
    Answer(instance, box->second, sent->second, answer.refused());
  }
}

void GameMessages::Expire(InstanceEntry& instance, Now now) {
  const auto box = boxes_.find(instance.number);
  if (box == boxes_.end() || box->second.waiting == 0) return;
  for (auto& [number, sent] : box->second.sent) {
    if (sent.record.answered() || now.unix_time - FromTimestamp(sent.record.time()) < kGameMessagePatience) continue;
    Answer(instance, box->second, sent, "no region has had the target since the message was sent");
  }
}

std::vector<v1::BackendMessage> GameMessages::Unanswered(const InstanceEntry& instance) const {
  std::vector<v1::BackendMessage> messages;
  const auto box = boxes_.find(instance.number);
  if (box == boxes_.end() || box->second.waiting == 0) return messages;
  for (const auto& [number, sent] : box->second.sent) {
    if (sent.record.answered()) continue;
    v1::BackendMessage& message = messages.emplace_back();
    message.set_number(number);
    message.set_body(sent.record.body());
    message.set_name(sent.record.name());
    message.set_values(sent.record.values());
  }
  return messages;
}

void GameMessages::Forget(std::uint64_t instance) {
  const auto box = boxes_.find(instance);
  if (box == boxes_.end()) return;
  std::vector<StoreOp> ops;
  for (const auto& [number, sent] : box->second.sent)
    ops.push_back(DeleteOp(MessageKey(instance, number), sent.revision));
  // Records that stay behind are removed when the next control plane starts.
  if (!ops.empty()) state_.WriteStored(ops).IgnoreError();
  boxes_.erase(box);
}

}  // namespace tessera::control
