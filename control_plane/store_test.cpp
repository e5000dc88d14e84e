// The suite that every Store passes.
#include "control_plane/store.h"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "control_plane/etcd/etcd_election.h"
#include "control_plane/etcd/etcd_store.h"
#include "control_plane/memory_store.h"
#include "control_plane/sqlite_store.h"
#include "control_plane/testing/fake_etcd.h"
#include "control_plane/testing/real_etcd.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

template <class S>
struct Fixture;
template <>
struct Fixture<MemoryStore> {
  std::unique_ptr<Store> store = std::make_unique<MemoryStore>();
  static bool Damage() { return false; }
};
template <>
struct Fixture<SqliteStore> {
  host::TemporaryFolder folder;
  std::unique_ptr<Store> store = *SqliteStore::Open(folder.path() + "/store.db");
  static bool Damage() { return false; }
};

// The store of an elected leader.
struct LedStore {
  explicit LedStore(const EtcdAddress& address)
      : prefix(address.prefix),
        client(*EtcdClient::Make(address, {})),
        election(*client, address.prefix, {.operators = "a:1", .players = ""}) {
    const auto fence = election.Campaign([](const auto&) {}, [] { return false; });
    store = *EtcdStore::Open(*client, address.prefix, *fence, nullptr);
  }
  // Writes other bytes over the last chunk that there is.
  bool Damage() const {
    etcdserverpb::RangeRequest chunks;
    chunks.set_key(prefix + "/chunk/");
    chunks.set_range_end(EtcdRangeEnd(chunks.key()));
    const auto found = client->Range(chunks, kEtcdReadPatience);
    if (!found.ok() || found->kvs().empty()) return false;
    etcdserverpb::TxnRequest other;
    etcdserverpb::PutRequest& put = *other.add_success()->mutable_request_put();
    put.set_key(found->kvs().rbegin()->key());
    put.set_value("other bytes");
    return client->Write(other, kEtcdWritePatience).ok();
  }
  std::string prefix;
  std::unique_ptr<EtcdClient> client;
  EtcdElection election;
  std::unique_ptr<Store> store;
};
struct OnFakeEtcd {};
template <>
struct Fixture<OnFakeEtcd> {
  FakeEtcd etcd;
  LedStore led{etcd.address()};
  std::unique_ptr<Store>& store = led.store;
  bool Damage() const { return led.Damage(); }
};
// One etcd serves all tests, each under keys of its own.
struct OnRealEtcd {};
template <>
struct Fixture<OnRealEtcd> {
  static EtcdAddress NewAddress() {
    static std::atomic<int> tests{0};
    return RealEtcd::Shared().address(absl::StrCat("suite/", ++tests));
  }
  LedStore led{NewAddress()};
  std::unique_ptr<Store>& store = led.store;
  bool Damage() const { return led.Damage(); }
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
    if (std::is_same_v<S, OnFakeEtcd>) return "FakeEtcd";
    if (std::is_same_v<S, OnRealEtcd>) return "RealEtcd";
    return std::is_same_v<S, MemoryStore> ? "Memory" : "Sqlite";
  }
};
using Stores = ::testing::Types<MemoryStore, SqliteStore, OnFakeEtcd, OnRealEtcd>;
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

TYPED_TEST(StoreTest, GivesEachTransactionAHigherRevision) {
  const Revision first = *this->store_.Put("a", "1", kAbsent);
  EXPECT_GT(first, kAbsent);
  const Revision other = *this->store_.Put("b", "1", kAbsent);
  EXPECT_GT(other, first);
  const Revision second = *this->store_.Put("a", "2", first);
  EXPECT_GT(second, other);
  EXPECT_EQ(this->store_.Get("a")->revision, second);
  EXPECT_EQ(this->store_.Get("b")->revision, other);
  const Revision gone = *this->store_.Delete("a", second);
  EXPECT_GT(gone, second);
  EXPECT_EQ(this->store_.revision(), gone);
  EXPECT_GT(*this->store_.Put("a", "3", kAbsent), gone);
}

TYPED_TEST(StoreTest, RefusesAWriterThatIsBehind) {
  const Revision first = *this->store_.Put("a", "1", kAbsent);
  const Revision second = *this->store_.Put("a", "2", first);
  const absl::StatusOr<Revision> late = this->store_.Put("a", "lost update", first);
  EXPECT_EQ(late.status().code(), absl::StatusCode::kAborted);
  EXPECT_THAT(std::string(late.status().message()),
              HasSubstr(absl::StrCat("a is at revision ", second, ", expected ", first)));
  EXPECT_EQ(this->store_.Put("a", "x", kAbsent).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Put("new", "x", 7).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Delete("a", first).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Delete("new", 1).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Get("a")->value, "2");
  EXPECT_EQ(this->store_.revision(), second);
}

TYPED_TEST(StoreTest, ATransactionIsAllOrNothing) {
  const Revision first = *this->store_.Put("a", "1", kAbsent);
  const StoreOp bad[] = {PutOp("b", "new", kAbsent), DeleteOp("a", first), PutOp("c", "x", 9)};
  EXPECT_EQ(this->store_.Txn(bad).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(this->store_.Get("a")->value, "1");
  EXPECT_FALSE(this->store_.Get("b").ok());
  EXPECT_EQ(this->store_.revision(), first);

  const StoreOp good[] = {PutOp("b", "new", kAbsent), DeleteOp("a", first)};
  const Revision both = *this->store_.Txn(good);
  EXPECT_EQ(this->store_.Get("b")->revision, both);
  EXPECT_FALSE(this->store_.Get("a").ok());
}

// A scene can be as large as a message.
TYPED_TEST(StoreTest, KeepsLargeValuesWhole) {
  std::string large(5'300'000, 'x');
  for (std::size_t i = 0; i < large.size(); i += 1000) large[i] = static_cast<char>(i / 1000);
  const StoreOp ops[] = {PutOp("scene/1", large, kAbsent), PutOp("instance/1", "small", kAbsent)};
  const absl::StatusOr<Revision> first = this->store_.Txn(ops);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_TRUE(this->store_.Get("scene/1")->value == large);
  EXPECT_EQ(this->store_.Get("scene/1")->revision, *first);
  EXPECT_TRUE(this->store_.List("scene/")->front().value == large);

  const std::string other = large.substr(2'000'000);
  const absl::StatusOr<Revision> second = this->store_.Put("scene/1", other, *first);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_TRUE(this->store_.Get("scene/1")->value == other);
  EXPECT_EQ(this->store_.Put("scene/1", large, *first).status().code(), absl::StatusCode::kAborted);
  EXPECT_TRUE(this->store_.Get("scene/1")->value == other);
  const absl::StatusOr<Revision> third = this->store_.Put("scene/1", "tiny", *second);
  ASSERT_TRUE(third.ok()) << third.status();
  EXPECT_EQ(this->store_.Get("scene/1")->value, "tiny");
  EXPECT_TRUE(this->store_.Delete("scene/1", *third).ok());
  EXPECT_EQ(this->store_.Get("scene/1").status().code(), absl::StatusCode::kNotFound);
}

// Whoever lists finds all others, and the place of the damaged one can be cleared.
TYPED_TEST(StoreTest, AValueThatIsNotWholeIsMarkedInItsListAndHidesNoOther) {
  const std::string large(1'500'000, 'x');
  ASSERT_TRUE(this->store_.Put("instance/1", "small", kAbsent).ok());
  const Revision written = *this->store_.Put("instance/2", large, kAbsent);
  ASSERT_TRUE(this->store_.Put("instance/3", "small", kAbsent).ok());
  if (!this->fixture_.Damage()) {  // its values lie whole: none is marked
    const auto all = this->store_.List("instance/");
    ASSERT_TRUE(all.ok()) << all.status();
    ASSERT_EQ(all->size(), 3U);
    for (const StoreEntry& entry : *all) EXPECT_FALSE(entry.damaged) << entry.key;
    return;
  }
  EXPECT_EQ(this->store_.Get("instance/2").status().code(), absl::StatusCode::kDataLoss);
  const auto listed = this->store_.List("instance/");
  ASSERT_TRUE(listed.ok()) << listed.status();
  ASSERT_EQ(listed->size(), 3U);
  EXPECT_FALSE((*listed)[0].damaged);
  EXPECT_TRUE((*listed)[1].damaged);
  EXPECT_FALSE((*listed)[2].damaged);
  EXPECT_EQ((*listed)[1].revision, written);
  EXPECT_EQ((*listed)[1].value.substr(0, 1000), large.substr(0, 1000)) << "what is left of it";
  const StoreOp moved[] = {PutOp("unreadable/instance/2", (*listed)[1].value, kAbsent),
                           DeleteOp("instance/2", written)};
  ASSERT_TRUE(this->store_.Txn(moved).ok());
  EXPECT_EQ(this->store_.Get("unreadable/instance/2")->value, (*listed)[1].value);
  EXPECT_EQ(this->store_.List("instance/")->size(), 2U);
}

// All events that a world's game published are forgotten at once.
TYPED_TEST(StoreTest, WritesThousandsOfKeysAtOnceOrNone) {
  std::vector<StoreOp> puts;
  puts.reserve(2500);
  for (int i = 0; i < 2500; ++i) puts.push_back(PutOp(absl::StrCat("event/1/", i), absl::StrCat("e", i), kAbsent));
  const absl::StatusOr<Revision> written = this->store_.Txn(puts);
  ASSERT_TRUE(written.ok()) << written.status();
  EXPECT_EQ(this->store_.List("event/")->size(), puts.size());
  EXPECT_EQ(this->store_.Get("event/1/2499")->revision, *written);

  std::vector<StoreOp> deletes;
  deletes.reserve(puts.size());
  for (const StoreOp& put : puts) deletes.push_back(DeleteOp(put.key, *written));
  deletes[1700].expected = *written + 1;
  const absl::Status refused = this->store_.Txn(deletes).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kAborted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("event/1/1700 is at"));
  EXPECT_EQ(this->store_.List("event/")->size(), puts.size());
  deletes[1700].expected = *written;
  EXPECT_TRUE(this->store_.Txn(deletes).ok());
  EXPECT_TRUE(this->store_.List("event/")->empty());
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

TYPED_TEST(StoreTest, ListsAllButAPrefixThatIsLeftOut) {
  for (const char* key : {"a/1", "b/1", "b/2", "bc", "c"}) ASSERT_TRUE(this->store_.Put(key, key, kAbsent).ok());
  const auto keys = [this](const char* prefix, const char* without) {
    std::vector<std::string> found;
    const auto listed = this->store_.ListWithout(prefix, without);
    for (const StoreEntry& entry : *listed) found.push_back(entry.key);
    return found;
  };
  using Keys = std::vector<std::string>;
  EXPECT_EQ(keys("", "b/"), (Keys{"a/1", "bc", "c"}));
  EXPECT_EQ(keys("", "b"), (Keys{"a/1", "c"}));
  EXPECT_EQ(keys("b", "b/2"), (Keys{"b/1", "bc"}));
  EXPECT_EQ(keys("b/", "b"), Keys());
  EXPECT_EQ(keys("b/", "a"), (Keys{"b/1", "b/2"}));
  EXPECT_EQ(keys("", "x"), (Keys{"a/1", "b/1", "b/2", "bc", "c"}));
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
  EXPECT_EQ(this->store_.revision(), this->store_.Get("n")->revision);
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

TEST(SqliteStoreTest, RefusesTheStoreOfANewerVersionAndLeavesItAsItIs) {
  const host::TemporaryFolder folder;
  const std::string path = folder.path() + "/store.db";
  ASSERT_TRUE((*SqliteStore::Open(path))->Put("a", "1", kAbsent).ok());
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "PRAGMA user_version = 2", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
  for (int again = 0; again < 2; ++again) {
    const absl::Status refused = SqliteStore::Open(path).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_EQ(refused.message(), "store " + path +
                                     ": has version 2, this program knows 1: start the newer tessera-control that "
                                     "wrote it");
  }
}

}  // namespace
}  // namespace tessera::control
