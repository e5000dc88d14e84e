#include "core/game/mail.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/game/settings.h"
#include "core/game/value.h"

namespace tessera::game {
namespace {

// How often the time between two reminders doubles.
constexpr std::uint64_t kMostDoublings = 5;

auto PlaceOf(const HeldMessage& message) { return std::pair(message.sender, message.number); }

absl::Status MailFault(absl::string_view list, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(list, ": ", what));
}

}  // namespace

// --- The sender's end

const SentMessage& Mail::Post(BodyId target, Tick made, RegionId made_in, Message what) {
  SentMessage message;
  message.number = ++last_number;
  message.after = LastTo(target);
  message.target = target;
  message.made = made;
  message.made_in = made_in;
  message.what = std::move(what);
  return outbox.emplace_back(std::move(message));
}

std::uint64_t Mail::LastTo(BodyId target) const {
  for (auto message = outbox.rbegin(); message != outbox.rend(); ++message) {
    if (message->target == target) return message->number;
  }
  return 0;
}

bool Mail::Acknowledged(BodyId target, std::uint64_t number) {
  return std::erase_if(outbox, [&](const SentMessage& message) {
           return message.number == number && message.target == target;
         }) > 0;
}

bool Mail::Settled(BodyId target, std::uint64_t number) const {
  return std::ranges::none_of(
      outbox, [&](const SentMessage& message) { return message.target == target && message.number <= number; });
}

std::size_t Mail::DropTo(BodyId target) {
  return std::erase_if(outbox, [&](const SentMessage& message) { return message.target == target; });
}

// --- The target's end

const Mail::Sender* Mail::Find(BodyId id) const {
  const auto at = std::ranges::lower_bound(senders, id, {}, &Sender::id);
  return at != senders.end() && at->id == id ? &*at : nullptr;
}

Mail::Arrival Mail::Take(HeldMessage message, Tick now) {
  auto sender = std::ranges::lower_bound(senders, message.sender, {}, &Sender::id);
  const bool known = sender != senders.end() && sender->id == message.sender;
  if (known && message.number <= sender->applied) return Arrival::kRepeated;
  const auto at = std::ranges::lower_bound(inbox, PlaceOf(message), {}, PlaceOf);
  if (at != inbox.end() && PlaceOf(*at) == PlaceOf(message)) return Arrival::kRepeated;
  if (inbox.size() >= kMaxInbox) return Arrival::kRefused;
  if (!known) {
    if (senders.size() >= kMaxSenders) {
      senders.erase(std::ranges::min_element(senders, {}, &Sender::heard));
      sender = std::ranges::lower_bound(senders, message.sender, {}, &Sender::id);
    }
    sender = senders.insert(sender, {message.sender, 0, now, Tick()});
  }
  sender->heard = now;
  sender->ends = Tick();
  inbox.insert(at, std::move(message));
  return Arrival::kNew;
}

bool Mail::TakeDirectly(HeldMessage message) {
  if (inbox.size() >= kMaxInbox) return false;
  const auto at = std::ranges::lower_bound(inbox, PlaceOf(message), {}, PlaceOf);
  inbox.insert(at, std::move(message));
  return true;
}

Mail::Arrival Mail::TakeFromBackend(std::uint64_t number, Message what, Tick now) {
  if (number <= backend) return Arrival::kRepeated;
  if (inbox.size() >= kMaxInbox) return Arrival::kRefused;
  backend = number;
  what.speaker = kBackendSender;
  HeldMessage held{kBackendSender, number, 0, now, now + 1, 0, std::move(what)};
  inbox.insert(std::ranges::lower_bound(inbox, PlaceOf(held), {}, PlaceOf), std::move(held));
  return Arrival::kNew;
}

bool Mail::Ready(std::vector<HeldMessage>::const_iterator message) const {
  if (message->after == 0) return true;
  const Sender* sender = Find(message->sender);
  return sender != nullptr && message->after <= sender->applied;
}

std::vector<HeldMessage> Mail::Due(Tick now) const {
  // When each is applied: not before the one of the same sender that comes before it.
  std::vector<std::pair<Tick, const HeldMessage*>> due;
  for (auto first = inbox.begin(); first != inbox.end();) {
    const auto end =
        std::find_if(first, inbox.end(), [&](const HeldMessage& one) { return one.sender != first->sender; });
    std::uint64_t applied = 0;
    Tick at;
    for (auto message = first; message != end && message->due <= now; ++message) {
      if (message->after > applied && !Ready(message)) break;
      applied = message->number;
      at = std::max(at, message->due);
      due.emplace_back(at, &*message);
    }
    first = end;
  }
  std::ranges::stable_sort(due, {}, [](const auto& one) { return one.first; });
  std::vector<HeldMessage> messages;
  messages.reserve(due.size());
  for (const auto& [at, message] : due) messages.emplace_back(*message).due = at;
  return messages;
}

std::optional<Tick> Mail::next_due() const {
  std::optional<Tick> next;
  for (auto message = inbox.begin(); message != inbox.end(); ++message) {
    const bool first = message == inbox.begin() || std::prev(message)->sender != message->sender;
    if (first && Ready(message)) next = next ? std::min(*next, message->due) : message->due;
  }
  return next;
}

bool Mail::Applied(BodyId sender, std::uint64_t number, Tick now) {
  const auto at = std::ranges::lower_bound(inbox, std::pair(sender, number), {}, PlaceOf);
  if (at == inbox.end() || PlaceOf(*at) != std::pair(sender, number)) return false;
  inbox.erase(at);
  const auto from = std::ranges::lower_bound(senders, sender, {}, &Sender::id);
  if (from != senders.end() && from->id == sender) {
    from->applied = number;
    from->heard = now;
  }
  return true;
}

bool Mail::RemindIn(const Sender& sender, Tick now) {
  if (sender.ends != Tick() || now <= sender.heard) return false;
  const auto silent = static_cast<std::uint64_t>(now - sender.heard);
  if (silent % kIdleTicks != 0) return false;
  const std::uint64_t times = silent / kIdleTicks, most = std::uint64_t{1} << kMostDoublings;
  return times >= most ? times % most == 0 : (times & (times - 1)) == 0;
}

bool Mail::Confirmed(BodyId sender, std::uint64_t number, Tick now) {
  const auto at = std::ranges::lower_bound(senders, sender, {}, &Sender::id);
  if (at == senders.end() || at->id != sender || at->ends != Tick() || at->applied > number) return false;
  const bool waits = std::ranges::any_of(inbox, [&](const HeldMessage& held) { return held.sender == sender; });
  if (waits) return false;
  at->ends = now + 2 * kTransitTicks;
  return true;
}

bool Mail::ForgetsBy(Tick now) const {
  return std::ranges::any_of(senders, [&](const Sender& one) { return one.ends != Tick() && one.ends <= now; });
}

bool Mail::Forget(Tick now) {
  return std::erase_if(senders, [&](const Sender& one) { return one.ends != Tick() && one.ends <= now; }) > 0;
}

// --- Bytes

void Write(ByteWriter& out, const Message& message) {
  out.Varint(message.speaker.value());
  out.Varint(message.verb);
  out.Block(std::string_view(message.name));
  out.Block(message.values);
}

void ReadMessage(ByteReader& in, Message& message) {
  message.speaker = BodyId(in.Varint());
  message.verb = in.Varint32();
  const auto name = in.Block(kMaxMessageNameBytes);
  message.name.assign(name.begin(), name.end());
  const auto values = in.Block(kMaxMessageBytes);
  message.values.assign(values.begin(), values.end());
}

absl::Status CheckMessage(const Message& message) {
  if (message.name.size() > kMaxMessageNameBytes) return absl::InvalidArgumentError("a name is too long");
  return DecodeFields(message.values, kMaxMessageBytes).status();
}

void Write(ByteWriter& out, const Mail& mail) {
  out.Varint(mail.last_number);
  out.Varint(mail.backend);
  out.Varint(mail.outbox.size());
  for (const SentMessage& message : mail.outbox) {
    out.Varint(message.number);
    out.Varint(message.after);
    out.Varint(message.target.value());
    out.Varint(message.made.value());
    out.Varint(message.made_in.value());
    Write(out, message.what);
  }
  out.Varint(mail.inbox.size());
  for (const HeldMessage& message : mail.inbox) {
    out.Varint(message.sender.value());
    out.Varint(message.number);
    out.Varint(message.after);
    out.Varint(message.made.value());
    out.Varint(message.due.value());
    out.Varint(message.hops);
    Write(out, message.what);
  }
  out.Varint(mail.senders.size());
  for (const Mail::Sender& sender : mail.senders) {
    out.Varint(sender.id.value());
    out.Varint(sender.applied);
    out.Varint(sender.heard.value());
    out.Varint(sender.ends.value());
  }
}

Mail ReadMail(ByteReader& in) {
  constexpr std::size_t kMinSentBytes = 9, kMinHeldBytes = 10, kMinSenderBytes = 4;
  Mail mail;
  mail.last_number = in.Varint();
  mail.backend = in.Varint();
  mail.outbox.resize(in.Count(kMinSentBytes));
  for (SentMessage& message : mail.outbox) {
    message.number = in.Varint();
    message.after = in.Varint();
    message.target = BodyId(in.Varint());
    message.made = Tick(in.Varint());
    message.made_in = RegionId(in.Varint32());
    ReadMessage(in, message.what);
  }
  mail.inbox.resize(in.Count(kMinHeldBytes));
  for (HeldMessage& message : mail.inbox) {
    message.sender = BodyId(in.Varint());
    message.number = in.Varint();
    message.after = in.Varint();
    message.made = Tick(in.Varint());
    message.due = Tick(in.Varint());
    message.hops = in.Varint32();
    ReadMessage(in, message.what);
  }
  mail.senders.resize(in.Count(kMinSenderBytes));
  for (Mail::Sender& sender : mail.senders) {
    sender.id = BodyId(in.Varint());
    sender.applied = in.Varint();
    sender.heard = Tick(in.Varint());
    sender.ends = Tick(in.Varint());
  }
  return mail;
}

absl::Status CheckMail(const Mail& mail) {
  if (mail.outbox.size() > kMaxInstanceOutbox) return MailFault("outbox", "too many messages");
  std::uint64_t last = 0;
  for (const SentMessage& message : mail.outbox) {
    if (message.number <= last || message.after >= message.number) {
      return MailFault("outbox", "numbers do not ascend");
    }
    last = message.number;
    if (absl::Status status = CheckMessage(message.what); !status.ok()) return MailFault("outbox", status.message());
  }
  if (last > mail.last_number) return MailFault("outbox", "a number above the last one");
  if (mail.inbox.size() > kMaxInbox) return MailFault("inbox", "too many messages");
  if (!std::ranges::is_sorted(mail.inbox, std::less_equal<>(), PlaceOf)) return MailFault("inbox", "out of order");
  for (const HeldMessage& message : mail.inbox) {
    if (message.after >= message.number) return MailFault("inbox", "a message that waits for itself");
    if (absl::Status status = CheckMessage(message.what); !status.ok()) return MailFault("inbox", status.message());
  }
  if (mail.senders.size() > kMaxSenders) return MailFault("senders", "too many");
  if (!std::ranges::is_sorted(mail.senders, std::less_equal<>(), &Mail::Sender::id)) {
    return MailFault("senders", "out of order");
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
