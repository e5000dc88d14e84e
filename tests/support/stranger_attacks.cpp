// Attacks of strangers, who have nothing to show.
#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tests/support/attack_calls.h"
#include "tests/support/attacks.h"

namespace tessera::support {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

bool IsForPlayers(const std::string& method) {
  return method.find("SessionService") != std::string::npos || method.ends_with("/ListInstances") ||
         method.ends_with("/GetInstance") || method.find("grpc.health") != std::string::npos;
}

}  // namespace

Outcome CallEveryMethod(const Target& target) {
  Outcome outcome;
  const auto operators = DialAlone(target.operators), players = DialAlone(target.players);
  for (const std::string& method : AllMethodNames()) {
    const grpc::Status at_operators = CallByName(operators, method);
    outcome.Try(fmt::format("operators' door: {} {}", method, at_operators.error_message()), IsRefusal(at_operators));
    if (IsForPlayers(method)) continue;
    const grpc::Status at_players = CallByName(players, method);
    outcome.Try(fmt::format("players' door: {} {}", method, at_players.error_message()), IsRefusal(at_players));
  }
  return outcome;
}

Outcome ShowLongTokens(const Target& target, int streams, std::size_t bytes) {
  v1::AgentMessage hello;
  hello.mutable_hello()->set_join_token(std::string(bytes, 'x'));
  hello.mutable_hello()->set_version(TESSERA_VERSION);
  hello.mutable_hello()->set_advertise_address("127.0.0.1");
  hello.mutable_hello()->mutable_resources()->set_region_capacity(1);
  Outcome outcome;
  std::mutex mutex;
  InParallel(streams, [&](int) {
    grpc::ClientContext context;
    context.set_deadline(Soon());
    const auto stream = v1::AgentLinkService::NewStub(DialAlone(target.operators))->Attach(&context);
    stream->Write(hello);
    v1::ControlMessage answer;
    const bool let_in = stream->Read(&answer);
    const grpc::Status status = stream->Finish();
    const std::lock_guard lock(mutex);
    outcome.Try("a long token: " + status.error_message(), !let_in && IsRefusal(status));
  });
  return outcome;
}

Outcome AskAtLength(const Target& target, int calls, std::size_t bytes) {
  struct Asked {
    std::string door, method;
  };
  const std::vector<Asked> all = {{target.operators, kHealthCheck},
                                  {target.operators, "/tessera.v1.InstanceService/CreateInstance"},
                                  {target.players, kHealthCheck},
                                  {target.players, "/tessera.v1.SessionService/JoinInstance"}};
  Outcome outcome;
  std::mutex mutex;
  InParallel(calls, [&](int i) {
    const Asked& asked = all[static_cast<std::size_t>(i) % all.size()];
    const grpc::Status status = CallByName(DialAlone(asked.door), asked.method, std::string(bytes, 'x'));
    const std::lock_guard lock(mutex);
    outcome.Try("a long request: " + asked.method + " " + status.error_message(),
                IsRefusal(status) || status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED ||
                    status.error_code() == grpc::StatusCode::UNAVAILABLE);
  });
  return outcome;
}

Outcome SayNothing(const Target& target, int streams) {
  Outcome outcome;
  const auto stub = v1::AgentLinkService::NewStub(DialAlone(target.operators));
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::AgentMessage, v1::ControlMessage>>> open;
  for (int i = 0; i < streams; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    contexts.back()->set_deadline(Soon());
    open.push_back(stub->Attach(contexts.back().get()));
  }
  // Meanwhile others are served; and the control plane ends each by itself, before our own patience does.
  outcome.Try("an operator waits", OperatorsCallSeconds(target) >= 0);
  for (auto& stream : open) {
    v1::ControlMessage answer;
    while (stream->Read(&answer)) {
    }
    const grpc::Status status = stream->Finish();
    outcome.Try("a stream stays: " + status.error_message(),
                status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  return outcome;
}

Outcome ImportAsStranger(const Target& target, int imports, std::size_t bytes) {
  Outcome outcome;
  std::mutex mutex;
  InParallel(imports, [&](int) {
    grpc::ClientContext context;
    context.set_deadline(Soon());
    v1::ImportCheckpointResponse response;
    const auto writer =
        v1::InstanceService::NewStub(DialAlone(target.operators))->ImportCheckpoint(&context, &response);
    v1::ImportCheckpointRequest piece;
    piece.set_data(std::string(kPieceBytes, 'x'));
    std::size_t sent = 0;
    while (sent < bytes && writer->Write(piece)) sent += kPieceBytes;
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    const std::lock_guard lock(mutex);
    outcome.Try("an import: " + status.error_message(), IsRefusal(status));
    outcome.Try(fmt::format("{} MiB of an import were read", sent >> 20), sent < bytes);
  });
  return outcome;
}

Outcome SpeakPlainText(const Target& target) {
  Outcome outcome;
  for (const std::string& door : {target.operators, target.players}) {
    const auto channel = grpc::CreateChannel(door.substr(0, door.find('#')), grpc::InsecureChannelCredentials());
    const grpc::Status status = CallByName(channel, "/tessera.v1.InstanceService/ListInstances");
    outcome.Try("plain text: " + door, status.error_code() == grpc::StatusCode::UNAVAILABLE);
  }
  return outcome;
}

}  // namespace tessera::support
