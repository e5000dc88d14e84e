// The suite that every Store passes.
#include "control_plane/store.h"

#include <gmock/gmock.h>

#include <fstream>
#include <thread>

#include "control_plane/memory_store.h"
#include "control_plane/sqlite_store.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

template <class S>
struct Fixture;
template <>
struct Fixture<MemoryStore> {
  std::unique_ptr<Store> store = std::make_unique<MemoryStore>();
};
template <>
struct Fixture<SqliteStore> {
  host::TemporaryFolder folder;
  std::unique_ptr<Store> store = *SqliteStore::Open(folder.path() + "/store.db");
};

template <class S>
class StoreTest : public ::testing::Test {
 protected:
  Fixture<S> fixture_;
  Store& store_ = *fixture_.store;
};

struct Names {
  template <class S>
  static std::string GetName(int) {
    return std::is_same_v<S, MemoryStore> ? "Memory" : "Sqlite";
  }
};
using Stores = ::testing::Types<MemoryStore, SqliteStore>;
TYPED_TEST_SUITE(StoreTest, Stores, Names);

TYPED_TEST(StoreTest, StartsEmptyAtRevisionZero) {
  EXPECT_EQ(this->store_.revision(), 0);
  EXPECT_TRUE(this->store_.List("")->empty());
  EXPECT_EQ(this->store_.Get("a").status().code(), absl::StatusCode::kNotFound);
}

TYPED_TEST(StoreTest, KeepsAnyBytes) {
  const std::string value("\0\xff'; DROP TABLE entries; --\0", 27);
  const std::string key("k\0\xfe", 3);
  ASSERT_TRUE(this->store_.Put(key, value, kAbsent).ok());
  ASSERT_TRUE(this->store_.Put("empty", "", kAbsent).ok());
  EXPECT_EQ(this->store_.Get(key)->value, value);
  EXPECT_EQ(this->store_.Get("empty")->value, "");
}

TYPED_TEST(StoreTest, GivesEachTransactionTheNextRevision) {
  EXPECT_EQ(*this->store_.Put("a", "1", kAbsent), 1);
  EXPECT_EQ(*this->store_.Put("b", "1", kAbsent), 2);
  EXPECT_EQ(*this->store_.Put("a", "2", 1), 3);
  EXPECT_EQ(this->store_.Get("a")->revision, 3);
  EXPECT_EQ(this->store_.Get("b")->revision, 2);
  EXPECT_EQ(*this->store_.Delete("a", 3), 4);
  EXPECT_EQ(this->store_.revision(), 4);
  EXPECT_EQ(*this->store_.Put("a", "3", kAbsent), 5);
}

TYPED_TEST(StoreTest, RefusesAWriterThatIsBehind) {
  ASSERT_TRUE(this->store_.Put("a", "1", kAbsent).ok());
  ASSERT_TRUE(this->store_.Put("a", "2", 1).ok());
  const absl::StatusOr<Revision> late = this->store_.Put("a", "lost update", 1);
  EXPECT_EQ(late.status().code(), absl::StatusCode::kAborted);
  EXPECT_THAT(std::string(late.status().message()), HasSubstr("a is at revision 2, expected 1"));
  EXPECT_EQ(this->store_.Put("a", "x", kAbsent).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Put("new", "x", 7).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Delete("a", 1).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Delete("new", 1).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Get("a")->value, "2");
  EXPECT_EQ(this->store_.revision(), 2);
}

TYPED_TEST(StoreTest, ATransactionIsAllOrNothing) {
  ASSERT_TRUE(this->store_.Put("a", "1", kAbsent).ok());
  const StoreOp bad[] = {PutOp("b", "new", kAbsent), DeleteOp("a", 1), PutOp("c", "x", 9)};
  EXPECT_EQ(this->store_.Txn(bad).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Get("a")->value, "1");
  EXPECT_FALSE(this->store_.Get("b").ok());
  EXPECT_EQ(this->store_.revision(), 1);

  const StoreOp good[] = {PutOp("b", "new", kAbsent), DeleteOp("a", 1)};
  EXPECT_EQ(*this->store_.Txn(good), 2);
  EXPECT_EQ(this->store_.Get("b")->revision, 2);
  EXPECT_FALSE(this->store_.Get("a").ok());
}

TYPED_TEST(StoreTest, RefusesMalformedTransactions) {
  EXPECT_EQ(this->store_.Txn({}).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(this->store_.Put("", "x", kAbsent).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(this->store_.Delete("a", kAbsent).status().code(), absl::StatusCode::kInvalidArgument);
  const StoreOp twice[] = {PutOp("a", "1", kAbsent), PutOp("a", "2", kAbsent)};
  EXPECT_EQ(this->store_.Txn(twice).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(this->store_.revision(), 0);
}

TYPED_TEST(StoreTest, ListsExactlyThePrefixInOrder) {
  for (const char* key : {"host/2", "hosts", "host/10", "instance/1", "host/1", "hosx"}) {
    ASSERT_TRUE(this->store_.Put(key, key, kAbsent).ok());
  }
  const absl::StatusOr<std::vector<StoreEntry>> found = this->store_.List("host/");
  ASSERT_TRUE(found.ok());
  std::vector<std::string> keys;
  for (const StoreEntry& entry : *found) keys.push_back(entry.key);
  EXPECT_EQ(keys, (std::vector<std::string>{"host/1", "host/10", "host/2"}));
  EXPECT_EQ(this->store_.List("")->size(), 6u);
  EXPECT_TRUE(this->store_.List("host/1x")->empty());
}

TYPED_TEST(StoreTest, ConcurrentIncrementsAreNeverLost) {
  ASSERT_TRUE(this->store_.Put("n", "0", kAbsent).ok());
  const auto increment = [this] {
    for (int done = 0; done < 25;) {
      const absl::StatusOr<StoreEntry> seen = this->store_.Get("n");
      const std::string next = std::to_string(std::stoi(seen->value) + 1);
      if (this->store_.Put("n", next, seen->revision).ok()) ++done;
    }
  };
  std::thread one(increment), two(increment);
  one.join();
  two.join();
  EXPECT_EQ(this->store_.Get("n")->value, "50");
  EXPECT_EQ(this->store_.revision(), 51);
}

TEST(SqliteStoreTest, KeepsEverythingOverARestart) {
  const host::TemporaryFolder folder;
  {
    auto store = *SqliteStore::Open(folder.path() + "/store.db");
    ASSERT_TRUE(store->Put("a", "1", kAbsent).ok());
    ASSERT_TRUE(store->Put("b", "2", kAbsent).ok());
    ASSERT_TRUE(store->Delete("b", 2).ok());
  }
  auto store = *SqliteStore::Open(folder.path() + "/store.db");
  EXPECT_EQ(store->revision(), 3);
  EXPECT_EQ(store->Get("a")->revision, 1);
  EXPECT_EQ(store->List("")->size(), 1u);
}

TEST(SqliteStoreTest, RefusesASecondOwner) {
  const host::TemporaryFolder folder;
  auto first = *SqliteStore::Open(folder.path() + "/store.db");
  const auto second = SqliteStore::Open(folder.path() + "/store.db");
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("in use by another process"));
}

TEST(SqliteStoreTest, RefusesWhatIsNotAStore) {
  const host::TemporaryFolder folder;
  std::ofstream(folder.path() + "/store.db") << std::string(8192, 'x');
  EXPECT_EQ(SqliteStore::Open(folder.path() + "/store.db").status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(SqliteStore::Open(folder.path() + "/no/such/folder.db").status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace tessera::control
