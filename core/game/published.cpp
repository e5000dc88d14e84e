#include "core/game/published.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/game/settings.h"
#include "core/game/value.h"

namespace tessera::game {
namespace {

absl::Status PublishedFault(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("published: ", what));
}

}  // namespace

bool Published::Add(PublishedEvent event) {
  std::size_t bytes = event.bytes();
  for (const Event& other : waiting) bytes += other->bytes();
  if (waiting.size() >= kMaxPublished || bytes > kMaxPublishedBytes) {
    ++left_out;
    return false;
  }
  event.number = ++last;
  event.missed = std::exchange(left_out, 0);
  waiting.push_back(std::make_shared<const PublishedEvent>(std::move(event)));
  return true;
}

bool Published::Acknowledge(std::uint64_t number) {
  return std::erase_if(waiting, [number](const Event& event) { return event->number <= number; }) > 0;
}

bool operator==(const Published& a, const Published& b) {
  return a.last == b.last && a.left_out == b.left_out &&
         std::ranges::equal(a.waiting, b.waiting, [](const Published::Event& one, const Published::Event& other) {
           return one == other || *one == *other;
         });
}

void Write(ByteWriter& out, const Published& published) {
  out.Varint(published.last);
  out.Varint(published.left_out);
  out.Varint(published.waiting.size());
  for (const Published::Event& event : published.waiting) {
    out.Varint(event->number);
    out.Varint(event->missed);
    out.Varint(event->tick.value());
    out.Varint(event->source.value());
    out.Block(std::string_view(event->name));
    out.Block(event->values);
  }
}

Published ReadPublished(ByteReader& in) {
  constexpr std::size_t kMinEventBytes = 6;
  Published published;
  published.last = in.Varint();
  published.left_out = in.Varint();
  const std::size_t count = in.Count(kMinEventBytes);
  for (std::size_t i = 0; in.ok() && i < count; ++i) {
    PublishedEvent event;
    event.number = in.Varint();
    event.missed = in.Varint();
    event.tick = Tick(in.Varint());
    event.source = BodyId(in.Varint());
    const auto name = in.Block(kMaxMessageNameBytes);
    event.name.assign(name.begin(), name.end());
    const auto values = in.Block(kMaxMessageBytes);
    event.values.assign(values.begin(), values.end());
    published.waiting.push_back(std::make_shared<const PublishedEvent>(std::move(event)));
  }
  return published;
}

absl::Status CheckPublished(const Published& published) {
  if (published.waiting.size() > kMaxPublished) return PublishedFault("too many events");
  std::uint64_t last = 0;
  for (const Published::Event& event : published.waiting) {
    if (event->number <= last || event->number > published.last) return PublishedFault("numbers do not ascend");
    last = event->number;
    if (event->name.size() > kMaxMessageNameBytes) return PublishedFault("a name is too long");
    if (const auto fields = DecodeFields(event->values, kMaxMessageBytes); !fields.ok()) {
      return PublishedFault(fields.status().message());
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::game
