#include "control_plane/bundle.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/world/sha256.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

DraftFile DraftOf(const std::string& bytes) {
  const host::TemporaryFolder folder;
  absl::StatusOr<DraftFile> draft = DraftFile::Create(folder.path());
  EXPECT_TRUE(draft.ok()) << draft.status();
  EXPECT_TRUE(draft->Append(bytes).ok());
  return *std::move(draft);
}

absl::StatusCode CodeOf(const std::string& bytes) {
  const DraftFile file = DraftOf(bytes);
  return BundleReader::Open(file).status().code();
}

TEST(BundleTest, ComesBackWholeOrNotAtAll) {
  records::Bundle bundle;
  bundle.mutable_manifest()->set_tick(7);
  records::ManifestFile& file = *bundle.mutable_manifest()->add_files();
  file.set_name("scene");
  file.set_hash(Sha256Hex("s"));
  AddContent(bundle, "scene", "s");
  const std::string bytes = Bundle(bundle);
  {
    const DraftFile draft = DraftOf(bytes);
    const auto reader = BundleReader::Open(draft);
    ASSERT_TRUE(reader.ok()) << reader.status();
    EXPECT_EQ(reader->manifest().tick(), 7u);
    EXPECT_EQ(*reader->Read("scene"), "s");
    EXPECT_EQ(reader->Read("game").status().code(), absl::StatusCode::kNotFound);
  }
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x20);
    EXPECT_NE(CodeOf(damaged), absl::StatusCode::kOk) << i;
    EXPECT_NE(CodeOf(bytes.substr(0, i)), absl::StatusCode::kOk) << i;
  }
}

// Names come from outside, and become names of files.
TEST(BundleTest, HoldsTheSceneAndOneFileForEachRegionAndNothingElse) {
  records::Bundle bundle;
  const auto add = [&](const std::string& name) {
    records::ManifestFile& file = *bundle.mutable_manifest()->add_files();
    file.set_name(name);
    file.set_hash(Sha256Hex("s"));
    AddContent(bundle, name, "s");
  };
  bundle.mutable_manifest()->mutable_map()->add_regions()->set_id(2);
  add("scene");
  EXPECT_EQ(CodeOf(Bundle(bundle)), absl::StatusCode::kInvalidArgument);
  add("region-2");
  EXPECT_EQ(CodeOf(Bundle(bundle)), absl::StatusCode::kOk);
  bundle.mutable_manifest()->set_game_hash("feed");
  EXPECT_EQ(CodeOf(Bundle(bundle)), absl::StatusCode::kInvalidArgument) << "its game is missing";
  add("game");
  EXPECT_EQ(CodeOf(Bundle(bundle)), absl::StatusCode::kOk);
  bundle.mutable_manifest()->set_game_native(true);
  EXPECT_EQ(CodeOf(Bundle(bundle)), absl::StatusCode::kInvalidArgument) << "hosts have that one";
  bundle.mutable_manifest()->set_game_native(false);
  add("../../control.db");
  EXPECT_EQ(CodeOf(Bundle(bundle)), absl::StatusCode::kInvalidArgument);
}

TEST(BundleTest, WithASumThatFitsNoOtherMessageIsTakenForOne) {
  const auto with_sum = [](const std::string& bytes) { return "TESSERA CHECKPOINT 1\n" + Sha256Hex(bytes) + bytes; };
  EXPECT_EQ(CodeOf(with_sum("")), absl::StatusCode::kInvalidArgument) << "a manifest without a scene";
  EXPECT_EQ(CodeOf(with_sum("no message")), absl::StatusCode::kDataLoss);
  records::Bundle twice;
  AddContent(twice, "scene", "s");
  AddContent(twice, "scene", "t");
  EXPECT_EQ(CodeOf(Bundle(twice)), absl::StatusCode::kDataLoss);
  // A content that says that it has more bytes than the file.
  const std::string longer{2 << 3 | 2, 4, 2 << 3 | 2, 127, 'x', 'x'};
  EXPECT_EQ(CodeOf(with_sum(longer)), absl::StatusCode::kDataLoss);
}

TEST(DraftFileTest, HasWhatWasAppendedAndLeavesNothing) {
  const host::TemporaryFolder folder;
  const std::string first(300'000, 'a'), second(1'500'000, 'b');
  {
    auto draft = DraftFile::Create(folder.path());
    ASSERT_TRUE(draft.ok()) << draft.status();
    ASSERT_TRUE(draft->Append(first).ok());
    ASSERT_TRUE(draft->Append(second).ok());
    EXPECT_EQ(draft->size(), 1'800'000u);
    EXPECT_EQ(*draft->Read(299'999, 2), "ab");
    EXPECT_EQ(*draft->Hash(0, draft->size()), Sha256Hex(first + second));
    EXPECT_EQ(draft->Read(1'799'999, 2).status().code(), absl::StatusCode::kDataLoss);
    EXPECT_EQ(draft->Read(~std::uint64_t{0}, 1).status().code(), absl::StatusCode::kDataLoss);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "it has no name";
  }
  EXPECT_EQ(DraftFile::Create(folder.path() + "/none").status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace tessera::control
