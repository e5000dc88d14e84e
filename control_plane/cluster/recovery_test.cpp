// A control plane that begins from a backup, until it has taken up what runs, on records and orders alone.
#include "control_plane/cluster/recovery.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <string>

#include "control_plane/backup.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using std::chrono::milliseconds;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;

class RecoveryPartTest : public ::testing::Test {
 protected:
  // A store that is made of a backup of the rig's, and a new life on it.
  void Restore() {
    std::string backup;
    const auto keep = [&backup](std::string_view piece) {
      backup += piece;
      return absl::OkStatus();
    };
    ASSERT_TRUE(WriteBackup(rig_.store, keep).ok());
    ASSERT_TRUE(RestoreBackup(backup, store_).ok());
    state_ = *ClusterState::Load(store_);
    recovery_ = std::make_unique<Recovery>(*state_, rig_.now);
    ASSERT_TRUE(recovery_->active());
  }

  // The order by which the world's region runs, as its agent holds it.
  v1::WorkerOrder OrderOf(std::uint32_t region) {
    const WorkerEntry& worker = StateRig::WorkerOf(world_, region);
    v1::WorkerOrder order;
    order.set_instance_id(world_.record.id());
    order.set_region(region);
    order.set_incarnation(worker.incarnation);
    *order.mutable_map() = world_.record.map();
    const net::VerificationKey& key = world_.key.verification_key();
    order.set_instance_key(std::string(key.begin(), key.end()));
    order.set_run(true);
    return order;
  }
  // The orders that a host holds of the regions that are placed on it.
  v1::HeldOrders HeldBy(const HostEntry& host) {
    v1::HeldOrders held;
    for (const records::Placement& place : world_.record.placements()) {
      if (place.host_id() == host.record.id()) *held.add_orders() = OrderOf(place.region());
    }
    return held;
  }
  void Answer(const HostEntry& host, const v1::HeldOrders& held) {
    recovery_->TakeOrders(*state_->FindHost(host.record.id()), held);
  }
  bool Step() { return recovery_->Step(rig_.now); }
  const records::Instance& RestoredWorld() { return state_->FindInstance(world_.record.id())->record; }
  const HostEntry& Restored(const HostEntry& host) { return *state_->FindHost(host.record.id()); }

  StateRig rig_;
  HostEntry &alpha_ = rig_.AddHost("alpha"), &beta_ = rig_.AddHost("beta");
  InstanceEntry& world_ = rig_.AddRunning({&alpha_, &beta_});
  MemoryStore store_;
  std::unique_ptr<ClusterState> state_;
  std::unique_ptr<Recovery> recovery_;
};

TEST_F(RecoveryPartTest, AStoreThatIsOfNoBackupIsNotRecovering) {
  Recovery recovery(*rig_.state, rig_.now);
  EXPECT_FALSE(recovery.active());
  EXPECT_FALSE(recovery.Step(rig_.now)) << "there is nothing to end";
}

TEST_F(RecoveryPartTest, WaitsUntilTheLastHostHasAnswered) {
  Restore();
  Answer(alpha_, HeldBy(alpha_));
  EXPECT_FALSE(Step());
  EXPECT_TRUE(recovery_->active());
  Answer(beta_, HeldBy(beta_));
  EXPECT_TRUE(Step());
  EXPECT_FALSE(recovery_->active());
  EXPECT_FALSE(Step()) << "it ends once";
  EXPECT_TRUE(Restored(alpha_).desired_changed && Restored(beta_).desired_changed) << "orders go out again";
}

TEST_F(RecoveryPartTest, AHostThatWasNeverAdmittedIsNotWaitedFor) {
  records::Host never;
  never.set_name("never");
  ASSERT_TRUE(rig_.state->AddHost(never).ok());
  Restore();
  Answer(alpha_, HeldBy(alpha_));
  Answer(beta_, HeldBy(beta_));
  EXPECT_TRUE(Step());
}

TEST_F(RecoveryPartTest, HasPatienceForASilentHostAndNoMore) {
  Restore();
  Answer(alpha_, HeldBy(alpha_));
  rig_.Pass(kRecoverPatience - milliseconds(1));
  EXPECT_FALSE(Step());
  rig_.Pass(milliseconds(1));
  EXPECT_TRUE(Step());
}

TEST_F(RecoveryPartTest, TakesAWorldUpByTheNewestMapThatAHostHolds) {
  Restore();
  v1::HeldOrders held = HeldBy(alpha_);
  const std::uint64_t newer = world_.record.map().version() + 5;
  held.mutable_orders(0)->mutable_map()->set_version(newer);
  Answer(alpha_, held);
  Answer(beta_, HeldBy(beta_));
  ASSERT_TRUE(Step());
  EXPECT_EQ(RestoredWorld().state(), v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(RestoredWorld().map().version(), newer);
  EXPECT_THAT(RestoredWorld().events().rbegin()->text(), HasSubstr("taken up as it runs"));
}

TEST_F(RecoveryPartTest, AWorldThatNoHostRunsHasEnded) {
  Restore();
  Answer(alpha_, {});
  Answer(beta_, {});
  ASSERT_TRUE(Step());
  EXPECT_EQ(RestoredWorld().state(), v1::INSTANCE_STATE_ENDED);
  EXPECT_THAT(RestoredWorld().reason(), HasSubstr("ran on none of its hosts"));
  EXPECT_TRUE(RestoredWorld().has_end_time());
  const auto& workers = state_->FindInstance(world_.record.id())->workers;
  EXPECT_TRUE(std::all_of(workers.begin(), workers.end(), [](const WorkerEntry& worker) { return worker.gone; }));
}

TEST_F(RecoveryPartTest, AWorldOfASilentHostIsNotTakenForEnded) {
  Restore();
  Answer(alpha_, {});
  rig_.Pass(kRecoverPatience);
  ASSERT_TRUE(Step());
  EXPECT_EQ(RestoredWorld().state(), v1::INSTANCE_STATE_RUNNING);
}

TEST_F(RecoveryPartTest, AWorldWithAWorkerThatIsHeardOfIsNotTakenForEnded) {
  Restore();
  recovery_->NoteAlive(StateRig::IdentityOf(world_, world_.workers[0]));
  Answer(alpha_, {});
  Answer(beta_, {});
  ASSERT_TRUE(Step());
  EXPECT_EQ(RestoredWorld().state(), v1::INSTANCE_STATE_RUNNING);
}

// A host cannot change the map of a world whose key it does not have the order of.
TEST_F(RecoveryPartTest, AnOrderOfAnotherKeyIsNotBelieved) {
  Restore();
  v1::HeldOrders forged = HeldBy(alpha_);
  forged.mutable_orders(0)->set_instance_key(std::string(32, 'x'));
  forged.mutable_orders(0)->mutable_map()->set_version(world_.record.map().version() + 5);
  Answer(alpha_, forged);
  Answer(beta_, HeldBy(beta_));
  ASSERT_TRUE(Step());
  EXPECT_LT(RestoredWorld().map().version(), forged.orders(0).map().version() + kRestoreJump);
  EXPECT_EQ(RestoredWorld().map().version(), world_.record.map().version()) << "as the other host's order says";
}

TEST_F(RecoveryPartTest, WorkersOfAnUnknownWorldAreKeptUntilTheyAreForgotten) {
  Restore();
  v1::HeldOrders held = HeldBy(alpha_);
  v1::WorkerOrder unknown = OrderOf(1);
  unknown.set_instance_id("inst-77");
  *held.add_orders() = unknown;
  unknown.set_region(2);
  *held.add_orders() = unknown;
  Answer(alpha_, held);
  Answer(beta_, HeldBy(beta_));
  ASSERT_TRUE(Step());
  v1::WorkerIdentity identity;
  identity.set_instance_id("inst-77");
  identity.set_region(1);
  identity.set_incarnation(unknown.incarnation());
  HostEntry& host = *state_->FindHost(alpha_.record.id());
  ASSERT_EQ(host.record.unknown_workers_size(), 2);
  EXPECT_TRUE(IsUnknownWorker(host, identity));
  EXPECT_FALSE(IsUnknownWorker(Restored(beta_), identity));

  ForgetUnknownWorker(*state_, host, identity);
  EXPECT_FALSE(IsUnknownWorker(host, identity));
  EXPECT_EQ(host.record.unknown_workers_size(), 1) << "the other one runs on";
  const auto forgotten = ForgetUnknown(*state_, "inst-77");
  ASSERT_TRUE(forgotten.ok()) << forgotten.status();
  EXPECT_TRUE(*forgotten);
  EXPECT_EQ(host.record.unknown_workers_size(), 0);
  EXPECT_FALSE(*ForgetUnknown(*state_, "inst-77")) << "there are none any more";
}

TEST_F(RecoveryPartTest, GoesOnWaitingWhileTheStoreCannotBeWrittenAndSaysSoOnce) {
  Restore();
  Answer(alpha_, HeldBy(alpha_));
  Answer(beta_, HeldBy(beta_));
  state_->effects().log.clear();
  store_.FailNext(2);
  EXPECT_FALSE(Step());
  EXPECT_FALSE(Step());
  const auto& log = state_->effects().log;
  const auto told = std::count_if(log.begin(), log.end(), [](const LogLine& line) {
    return line.text.find("what runs cannot be taken up") != std::string::npos;
  });
  EXPECT_EQ(told, 1);
  EXPECT_THAT(log, Contains(Field(&LogLine::severity, Severity::kError)));
  EXPECT_TRUE(Step()) << "it can be written again";
}

}  // namespace
}  // namespace tessera::control
