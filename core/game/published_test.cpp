#include "core/game/published.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/game/record.h"
#include "core/game/settings.h"
#include "core/game/value.h"

namespace tessera::game {
namespace {

using ::testing::HasSubstr;

PublishedEvent EventNamed(std::string name) {
  PublishedEvent event;
  event.tick = Tick(7);
  event.source = BodyId(3);
  event.name = std::move(name);
  event.values = *EncodeFields({{"score", std::int64_t{2}}});
  return event;
}

Published Copied(const Published& published) {
  ByteWriter out;
  Write(out, published);
  const std::vector<std::uint8_t> bytes = out.Take();
  ByteReader in(bytes);
  Published copy = ReadPublished(in);
  EXPECT_TRUE(in.ok());
  EXPECT_EQ(in.remaining(), 0U);
  return copy;
}

TEST(PublishedTest, EventsAreNumberedAndWaitUntilTheyAreAcknowledged) {
  Published published;
  for (const char* name : {"a", "b", "c"}) EXPECT_TRUE(published.Add(EventNamed(name)));
  EXPECT_EQ(published.waiting.back()->number, 3U);
  EXPECT_TRUE(published.Acknowledge(2));
  EXPECT_FALSE(published.Acknowledge(2));
  ASSERT_EQ(published.waiting.size(), 1U);
  EXPECT_EQ(published.waiting.front()->name, "c");
  EXPECT_TRUE(published.Acknowledge(9));
  EXPECT_FALSE(published.empty()) << "its numbers go on";
  EXPECT_TRUE(published.Add(EventNamed("d")));
  EXPECT_EQ(published.waiting.front()->number, 4U);
}

TEST(PublishedTest, WhatIsLeftOutIsSaidByTheNextEvent) {
  Published published;
  for (std::size_t i = 0; i < kMaxPublished; ++i) ASSERT_TRUE(published.Add(EventNamed("a")));
  EXPECT_FALSE(published.Add(EventNamed("b")));
  EXPECT_FALSE(published.Add(EventNamed("b")));
  EXPECT_EQ(published.last, kMaxPublished);
  published.Acknowledge(1);
  ASSERT_TRUE(published.Add(EventNamed("c")));
  EXPECT_EQ(published.waiting.back()->missed, 2U);
  EXPECT_EQ(published.waiting.back()->number, kMaxPublished + 1);
  published.Acknowledge(2);
  ASSERT_TRUE(published.Add(EventNamed("d")));
  EXPECT_EQ(published.waiting.back()->missed, 0U);
}

TEST(PublishedTest, BytesAreBoundedToo) {
  Published published;
  PublishedEvent large = EventNamed("large");
  large.values.resize(kMaxMessageBytes);
  std::size_t kept = 0;
  while (published.Add(large)) ++kept;
  EXPECT_LE(kept * large.bytes(), kMaxPublishedBytes);
  EXPECT_GT((kept + 1) * large.bytes(), kMaxPublishedBytes);
}

TEST(PublishedTest, IsReadAsItWasWrittenAlsoInARecord) {
  GameRecord record;
  record.published.Add(EventNamed("a"));
  record.published.Add(EventNamed("b"));
  record.published.left_out = 3;
  record.published.Acknowledge(1);
  EXPECT_EQ(Copied(record.published), record.published);
  EXPECT_TRUE(CheckPublished(record.published).ok());
  ByteWriter out;
  Write(out, record);
  const std::vector<std::uint8_t> bytes = out.Take();
  ByteReader in(bytes);
  EXPECT_EQ(ReadRecord(in), record);
  EXPECT_NE(GameRecord(), record);
}

TEST(PublishedTest, BytesThatAreNotSoundAreRefused) {
  const auto refused = [](const auto& change) {
    Published published;
    published.Add(EventNamed("a"));
    published.Add(EventNamed("b"));
    auto event = std::make_shared<PublishedEvent>(*published.waiting.back());
    change(*event);
    published.waiting.back() = event;
    return CheckPublished(published).ToString();
  };
  EXPECT_THAT(refused([](PublishedEvent& event) { event.number = 1; }), HasSubstr("numbers do not ascend"));
  EXPECT_THAT(refused([](PublishedEvent& event) { event.number = 3; }), HasSubstr("numbers do not ascend"));
  EXPECT_THAT(refused([](PublishedEvent& event) { event.name.resize(33); }), HasSubstr("a name is too long"));
  EXPECT_THAT(refused([](PublishedEvent& event) { event.values = {1}; }), HasSubstr("published: values"));
}

}  // namespace
}  // namespace tessera::game
