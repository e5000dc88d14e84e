#include "gateway/instance_feed.h"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "trust/dial.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;

constexpr auto kAskAgain = 1s;
constexpr auto kListDeadline = 5s;
constexpr int kListPage = 1000;

bool IsOver(v1::InstanceState state) { return state == v1::INSTANCE_STATE_ENDED || state == v1::INSTANCE_STATE_FAILED; }

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::Channel>> DialControl(const trust::ControlPoint& control) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  arguments.SetMaxReceiveMessageSize(-1);
  return trust::Dial(control.address, control.credentials, arguments);
}

InstanceFeed::InstanceFeed(std::shared_ptr<grpc::Channel> channel, std::string id, std::function<void()> wake)
    : channel_(std::move(channel)), id_(std::move(id)), wake_(std::move(wake)), thread_([this] { Run(); }) {}

InstanceFeed::~InstanceFeed() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    if (call_ != nullptr) call_->TryCancel();
  }
  ended_.notify_all();
  thread_.join();
}

std::optional<InstanceFeed::State> InstanceFeed::Latest(std::uint64_t known) const {
  const std::lock_guard lock(mutex_);
  return state_.number == known ? std::nullopt : std::optional(state_);
}

void InstanceFeed::Run() {
  while (WatchOnce()) {
    std::unique_lock lock(mutex_);
    if (ended_.wait_for(lock, kAskAgain, [this] { return ending_; })) return;
  }
}

bool InstanceFeed::WatchOnce() {
  grpc::ClientContext context;
  {
    const std::lock_guard lock(mutex_);
    if (ending_) return false;
    call_ = &context;
  }
  const auto stub = v1::InstanceService::NewStub(channel_);
  v1::WatchInstanceRequest request;
  request.set_id(id_);
  const auto stream = stub->WatchInstance(&context, request);
  v1::WatchInstanceResponse response;
  while (stream->Read(&response)) {
    {
      const std::lock_guard lock(mutex_);
      ++state_.number;
      state_.instance = std::move(*response.mutable_instance());
      state_.since = std::chrono::steady_clock::now();
      state_.problem = absl::OkStatus();
    }
    wake_();
  }
  const grpc::Status status = stream->Finish();
  const std::lock_guard lock(mutex_);
  call_ = nullptr;
  if (ending_ || (status.ok() && IsOver(state_.instance.state()))) return false;
  state_.problem = status.ok()
                       ? absl::UnavailableError("the control plane ended the stream")
                       : absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  return status.error_code() != grpc::StatusCode::NOT_FOUND;
}

WorldList::WorldList(std::shared_ptr<grpc::Channel> channel, std::string address)
    : channel_(std::move(channel)),
      address_(std::move(address)),
      list_{.instances = {}, .problem = absl::StrCat("control plane at ", address_, ": it has not answered yet.")},
      thread_([this] { Run(); }) {}

WorldList::~WorldList() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

WorldList::List WorldList::Latest() const {
  const std::lock_guard lock(mutex_);
  return list_;
}

void WorldList::Run() {
  const auto stub = v1::InstanceService::NewStub(channel_);
  while (true) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kListDeadline);
    v1::ListInstancesRequest request;
    request.set_page_size(kListPage);
    v1::ListInstancesResponse response;
    const grpc::Status status = stub->ListInstances(&context, request, &response);
    std::unique_lock lock(mutex_);
    list_.problem = status.ok() ? ""
                                : absl::StrCat("control plane at ", address_, ": ", status.error_message(),
                                               "; is it running, and is --control its address?");
    if (status.ok()) list_.instances.assign(response.instances().begin(), response.instances().end());
    if (ended_.wait_for(lock, kAskAgain, [this] { return ending_; })) return;
  }
}

}  // namespace tessera::gateway
