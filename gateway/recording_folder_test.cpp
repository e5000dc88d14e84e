// A gateway's folder of recordings: names from outside, limits, and what it lists.
#include "gateway/recording_folder.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "client_sdk/recording.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using testing::HasSubstr;

constexpr std::chrono::system_clock::time_point kNow{std::chrono::seconds(1'767'225'600)};  // 2026-01-01

class RecordingFolderTest : public testing::Test {
 protected:
  void Write(const std::string& name, std::size_t bytes) {
    std::ofstream(folder_.path() + "/" + name, std::ios::binary) << std::string(bytes, 'x');
  }
  host::TemporaryFolder folder_;
};

TEST_F(RecordingFolderTest, NamesSayWhatAndWhen) {
  const RecordingFolder folder(folder_.path(), {});
  auto place = folder.Make("plaza-1", kNow);
  ASSERT_TRUE(place.ok()) << place.status();
  EXPECT_EQ(place->file, "plaza-1-20260101T000000Z.rec");
  EXPECT_EQ(place->path, folder_.path() + "/" + place->file);
  EXPECT_EQ(place->max_bytes, 1'000'000'000u);
  Write(place->file, 10);
  place = folder.Make("plaza-1", kNow);
  ASSERT_TRUE(place.ok()) << place.status();
  EXPECT_EQ(place->file, "plaza-1-20260101T000000Z-2.rec") << "none is written over";
}

TEST_F(RecordingFolderTest, AFullFolderTakesNoMore) {
  Write("a.rec", 3'000'000);
  Write("b.rec", 4'000'000);
  Write("else.txt", 9'000'000);
  auto place = RecordingFolder(folder_.path(), {.file_bytes = 5'000'000, .folder_bytes = 10'000'000}).Make("p", kNow);
  ASSERT_TRUE(place.ok()) << place.status();
  EXPECT_EQ(place->max_bytes, 3'000'000u) << "what is left";
  place = RecordingFolder(folder_.path(), {.file_bytes = 5'000'000, .folder_bytes = 7'050'000}).Make("p", kNow);
  EXPECT_EQ(place.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(place.status().message()), HasSubstr("7 MB, of 7; remove some, or see --recordings-mb"));
}

TEST_F(RecordingFolderTest, NamesFromOutsideLeadNowhereElse) {
  std::ofstream(folder_.path() + "/secret.rec") << "x";
  std::filesystem::create_directory(folder_.path() + "/in");
  std::filesystem::create_directory(folder_.path() + "/in/folder.rec");
  Write("in/mine.rec", 5);
  const RecordingFolder folder(folder_.path() + "/in", {});
  EXPECT_EQ(folder.PathOf("mine.rec").value_or(""), folder_.path() + "/in/mine.rec");
  for (const std::string name : {"../secret.rec", "/etc/passwd", "..", "", ".rec", "folder.rec", "other.rec", "mine",
                                 "a/../mine.rec", "mine.rec/", "mi ne.rec"}) {
    EXPECT_EQ(folder.PathOf(name).status().code(), absl::StatusCode::kNotFound) << name;
  }
  EXPECT_FALSE(folder.PathOf(std::string("mine.rec\0.rec", 13)).ok());
  EXPECT_FALSE(folder.PathOf(std::string(5000, 'a') + ".rec").ok());
}

TEST_F(RecordingFolderTest, WithoutAFolderThereAreNone) {
  const RecordingFolder folder("", {});
  EXPECT_TRUE(folder.Open().ok());
  EXPECT_TRUE(folder.List().empty());
  EXPECT_FALSE(folder.PathOf("a.rec").ok());
  EXPECT_THAT(std::string(folder.Make("p", kNow).status().message()), HasSubstr("--recordings-dir"));
  EXPECT_TRUE(RecordingFolder(folder_.path() + "/new/folder", {}).Open().ok());
  EXPECT_TRUE(std::filesystem::is_directory(folder_.path() + "/new/folder"));
  const absl::Status file = RecordingFolder("/dev/null/x", {}).Open();
  EXPECT_EQ(file.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(file.message()), HasSubstr("--recordings-dir /dev/null/x"));
}

TEST_F(RecordingFolderTest, ListsTheNewestFirstWithWhatTheySay) {
  const RecordingFolder folder(folder_.path(), {});
  Write("older.rec", 100);
  Write("not-one.txt", 100);
  std::filesystem::last_write_time(folder_.path() + "/older.rec",
                                   std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  auto writer = client::RecordingWriter::Create(folder_.path() + "/newer.rec", {.instance_id = "plaza-1"}, 100'000);
  ASSERT_TRUE(writer.ok()) << writer.status();
  auto list = folder.List();
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].file, "newer.rec");
  EXPECT_FALSE(list[0].seconds) << "it is not ended";
  ASSERT_TRUE(writer->Close(std::chrono::milliseconds(2500)).ok());
  list = folder.List();
  EXPECT_EQ(list[0].instance, "plaza-1");
  EXPECT_EQ(list[0].bytes, writer->bytes());
  EXPECT_EQ(list[0].seconds, 2.5);
  EXPECT_EQ(list[1].file, "older.rec");
  EXPECT_EQ(list[1].instance, "") << "it is no recording at all";
}

}  // namespace
}  // namespace tessera::gateway
