#include "control_plane/door_limits.h"

#include <limits>
#include <utility>

#include "control_plane/control_settings.h"
#include "control_plane/counted_address.h"

namespace tessera::control {
namespace {

template <class Duration>
int MillisecondsOf(Duration duration) {
  return static_cast<int>(std::chrono::milliseconds(duration).count());
}

// Whether the method keeps what it is sent until it is whole.
bool IsImport(std::string_view method) {
  return method == "InstanceService/ImportCheckpoint" || method == "InstanceService/PutScene" ||
         method == "VisualService/PutVisual";
}

}  // namespace

std::size_t RequestLimit(std::string_view method) {
  if (method == "InstanceService/CreateInstance") return kMaxMessageBytes;
  return method == "InstanceService/SetGame" ? kGameRequestBytes : kRequestBytes;
}

std::size_t StreamMessageLimit(std::string_view method) {
  if (method == "AgentLinkService/Attach") return kMaxMessageBytes;
  return (method == "VisualService/PutVisual" ? kVisualPieceBytes : kPieceBytes) + kAroundPieceBytes;
}

void SetDoorLimits(grpc::ServerBuilder& builder, Door door) {
  builder.SetMaxReceiveMessageSize(door == Door::kPlayers ? kPlayersMessageBytes : kMaxMessageBytes);
  builder.SetMaxSendMessageSize(kMaxMessageBytes);
  if (door == Door::kSocket) return;
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, MillisecondsOf(kHandshakePatience));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, MillisecondsOf(kConnectionIdle));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             door == Door::kPlayers ? kPlayersStreams : kOperatorsStreams);
  grpc::ResourceQuota quota(door == Door::kPlayers ? "players" : "operators");
  quota.Resize(door == Door::kPlayers ? kPlayersMemoryBytes : kOperatorsMemoryBytes);
  if (door == Door::kPlayers) {
    quota.SetMaxThreads(kPlayersThreads);
    builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    builder.AddChannelArgument(GRPC_ARG_TCP_MAX_READ_CHUNK_SIZE, kPlayersReadBytes);
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, MillisecondsOf(kPlayersConnectionAge));
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS, MillisecondsOf(kPlayersConnectionGrace));
  }
  builder.SetResourceQuota(quota);
}

std::unique_ptr<CallSlots::Slot> CallSlots::Take(const Caller& caller, const std::string& peer,
                                                 std::string_view method) {
  std::string key;  // the socket's: never looked up
  int most = std::numeric_limits<int>::max();
  if (caller.door != Door::kSocket) {
    const bool has_name = caller.door == Door::kOperators && (!caller.token.empty() || !caller.host_id.empty());
    key = has_name ? caller.Name() : "address " + CountedPeer(peer);
    most = has_name ? kCallsOfACaller : kCallsOfAnAddress;
    if (IsImport(method)) {
      key += " imports";
      most = kImportsOfACaller;
    }
  }
  {
    const std::lock_guard lock(mutex_);
    int& calls = calls_[key];
    if (calls >= most) return nullptr;
    ++calls;
  }
  return std::make_unique<Slot>(*this, std::move(key));
}

std::size_t CallSlots::callers() const {
  const std::lock_guard lock(mutex_);
  return calls_.size();
}

void CallSlots::GiveBack(const std::string& key) {
  const std::lock_guard lock(mutex_);
  const auto found = calls_.find(key);
  if (--found->second == 0) calls_.erase(found);
}

}  // namespace tessera::control
