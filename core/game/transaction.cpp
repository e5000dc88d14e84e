#include "core/game/transaction.h"

#include <cassert>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"

namespace tessera::game {

const Transaction::Found& Transaction::FindAnew(BodyId id) const {
  found_ = {id, nullptr, false};
  if (const auto made = made_.find(id); made != made_.end()) {
    found_ = {id, &made->second.def, true};
  } else if (!removed_.contains(id)) {
    found_ = {id, world_.Find(id), world_.Owns(id)};
  }
  return found_;
}

BodyState Transaction::StateOf(BodyId id) const {
  if (const auto made = made_.find(id); made != made_.end()) return made->second.state;
  const auto placed = placed_.find(id);
  return placed != placed_.end() ? placed->second : world_.StateOf(id);
}

PropertySet Transaction::PropertiesOf(BodyId id) const {
  const auto found = changes_.find(id);
  if (found == changes_.end() && id == kInstanceBody && !Owns(id)) return world_.KnownOfInstance();
  return found == changes_.end() ? world_.ChangedOf(id) : found->second.properties;
}

const GameRecord& Transaction::RecordOf(BodyId id) const {
  const auto found = changes_.find(id);
  return found == changes_.end() ? world_.RecordOf(id) : found->second.record;
}

Transaction::Changes* Transaction::Own(BodyId id) {
  if (const auto found = changes_.find(id); found != changes_.end()) return &found->second;
  if (!Owns(id)) return nullptr;
  return &changes_.emplace(id, Changes{world_.ChangedOf(id), world_.RecordOf(id)}).first->second;
}

absl::StatusOr<BodyId> Transaction::Spawn(std::size_t prefab, const SpawnMotion& motion) {
  const Scene& scene = world_.scene();
  const std::size_t count = scene.prefabs[prefab].bodies.size();
  if (count > limits_.bodies) return absl::ResourceExhaustedError("more bodies than a region may make in a tick");
  const std::size_t bodies = world_.OwnedCount() + made_.size();
  if (bodies + count > limits_.in_region) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the region has ", bodies, " bodies, of at most ", limits_.in_region));
  }
  const std::optional<BodyId> first = world_.NextId(prefab);
  if (!first) return absl::ResourceExhaustedError("the region has given all its ids");
  found_ = {};
  limits_.bodies -= count;
  for (std::size_t member = 0; member < count; ++member) {
    const BodyId id = WithMember(*first, member);
    const BodyDef& body = scene.prefabs[prefab].bodies[member];
    made_.emplace(id, Made{MakeSpawned(scene, id), SpawnedState(body, motion)});
    changes_.emplace(id, Changes{}).first->second.record.game = game_;
  }
  return *first;
}

BodyState* Transaction::MadeState(BodyId id) {
  const auto made = made_.find(id);
  return made == made_.end() ? nullptr : &made->second.state;
}

void Transaction::Remove(BodyId id) {
  assert(Owns(id));
  found_ = {};
  auto changes = changes_.extract(id);
  if (made_.erase(id) != 0) return;
  removed_.insert(id);
  if (!changes.empty()) last_words_.insert(std::move(changes));
}

Mail* Transaction::MailOf(BodyId carrier) {
  if (Changes* own = Own(carrier); own != nullptr) return &own->record.mail;
  if (!removed_.contains(carrier)) return nullptr;
  const auto [entry, added] = last_words_.try_emplace(carrier);
  if (added) entry->second = {world_.ChangedOf(carrier), world_.RecordOf(carrier)};
  return &entry->second.record.mail;
}

absl::Status Transaction::Send(BodyId carrier, BodyId target, Tick now, Message what) {
  Mail* const mail = MailOf(carrier);
  if (mail == nullptr) {
    return absl::FailedPreconditionError(carrier == kInstanceBody ? "the world's record is owned by another region"
                                                                  : "the sender is not owned by this region");
  }
  if (limits_.messages == 0) return absl::ResourceExhaustedError("more messages than a region may send in a tick");
  if (Changes* to = Own(target); to != nullptr) {
    const std::uint64_t after = mail->LastTo(target);
    HeldMessage held{carrier, ++mail->last_number, after, now, now + kDirectTicks, 0, std::move(what)};
    if (!to->record.mail.TakeDirectly(std::move(held))) {
      return absl::ResourceExhaustedError(absl::StrCat("the target has ", kMaxInbox, " messages waiting already"));
    }
  } else {
    const std::size_t most = carrier == kInstanceBody ? kMaxInstanceOutbox : kMaxOutbox;
    if (mail->outbox.size() >= most) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the sender has ", most, " messages under way already, which nobody has acknowledged"));
    }
    mail->Post(target, now, world_.region(), std::move(what));
  }
  --limits_.messages;
  ++sent_;
  return absl::OkStatus();
}

absl::Status Transaction::Explode(Blast blast) {
  if (world_.BlastCount() + blasts_.size() >= kMaxBlasts) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the region keeps ", kMaxBlasts, " of the last ten seconds already"));
  }
  blasts_.push_back(std::move(blast));
  return absl::OkStatus();
}

std::size_t Transaction::Commit() {
  found_ = {};
  for (Blast& blast : blasts_) world_.Explode(std::move(blast));
  blasts_.clear();
  if (changes_.empty() && removed_.empty() && made_.empty()) return 0;
  for (const auto& [id, made] : made_) world_.Spawn(id, made.state);
  for (const auto& [id, state] : placed_) world_.Place(id, state);
  const bool together = changes_.size() + removed_.size() > 1;
  for (auto& [id, changes] : changes_) world_.Commit(id, changes.properties, std::move(changes.record), together);
  for (const BodyId id : removed_) {
    // A call may let a body send a message and go.
    const auto last = last_words_.find(id);
    if (last != last_words_.end() && !last->second.record.mail.outbox.empty()) {
      world_.Commit(id, last->second.properties, std::move(last->second.record), together);
    }
    world_.Remove(id);
  }
  changes_.clear();
  placed_.clear();
  removed_.clear();
  last_words_.clear();
  return std::exchange(made_, {}).size();
}

}  // namespace tessera::game
