// Attacks of people who have an access token, with too small a right.
#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "local_cluster/command_error.h"
#include "tessera/v1/access.grpc.pb.h"
#include "tessera/v1/instance.pb.h"
#include "tests/support/attack_calls.h"
#include "tests/support/attacks.h"

namespace tessera::support {
namespace {

// `instances`: as AccessToken has it.
std::string MakeToken(const Target& target, const std::string& name, v1::Role role, const std::string& instances) {
  v1::CreateTokenRequest request;
  request.set_name(name);
  request.set_role(role);
  request.set_instances(instances);
  v1::CreateTokenResponse made;
  grpc::ClientContext context;
  const grpc::Status status =
      v1::AccessService::NewStub(DialAlone(target.socket))->CreateToken(&context, request, &made);
  if (!status.ok()) throw local::CommandError("token create: " + status.error_message());
  return made.secret();
}

std::shared_ptr<grpc::Channel> DialWith(const Target& target, const std::string& token) {
  return DialAlone(target.operators, {.authority = {}, .certificate = {}, .key = {}, .bearer_token = token});
}

// All but those that only look. Joins change something, and a viewer's token joins as a viewer.
bool Changes(const std::string& method) {
  const std::string name = method.substr(method.rfind('/') + 1);
  for (const char* look : {"/grpc.", "/Get", "/List", "/Watch", "SessionService/GetScene", "SessionService/StreamScene",
                           "SessionService/LeaveInstance"}) {
    if (method.find(look) != std::string::npos) return false;
  }
  return !name.empty();
}

// A request of the method about that instance; nothing: it concerns none.
std::string AboutInstance(const std::string& method, const std::string& instance) {
  std::string name = method.substr(1);
  name[name.find('/')] = '.';
  const auto* found = google::protobuf::DescriptorPool::generated_pool()->FindMethodByName(name);
  if (found == nullptr) return "";
  const google::protobuf::Descriptor* type = found->input_type();
  const google::protobuf::FieldDescriptor* field = type->FindFieldByName("instance_id");
  if (field == nullptr && type->file() == v1::Instance::descriptor()->file()) field = type->FindFieldByName("id");
  if (field == nullptr) return "";
  const std::unique_ptr<google::protobuf::Message> request(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
  request->GetReflection()->SetString(request.get(), field, instance);
  return request->SerializeAsString();
}

}  // namespace

Outcome ChangeEverything(const Target& target, const std::string& instance) {
  Outcome outcome;
  const auto viewer = DialWith(target, MakeToken(target, "watcher", v1::ROLE_VIEWER, ""));
  const auto elsewhere = DialWith(target, MakeToken(target, "elsewhere", v1::ROLE_OPERATOR, instance + "-none"));
  outcome.Try("a viewer sees nothing", CallByName(viewer, "/tessera.v1.HostService/ListHosts").ok());
  outcome.Try("an operator of another instance sees nothing",
              CallByName(elsewhere, "/tessera.v1.InstanceService/ListInstances").ok());
  for (const std::string& method : AllMethodNames()) {
    const std::string about = AboutInstance(method, instance);
    if (Changes(method)) {
      const grpc::Status status = CallByName(viewer, method, about);
      outcome.Try(fmt::format("viewer: {} {}", method, status.error_message()), IsRefusal(status));
    }
    if ((Changes(method) || !about.empty()) && !method.ends_with("/LeaveInstance")) {
      const grpc::Status status = CallByName(elsewhere, method, about);
      outcome.Try(fmt::format("operator of another instance: {} {}", method, status.error_message()),
                  IsRefusal(status));
    }
  }
  const v1::Instance now = GetInstance(target, instance);
  outcome.Try("the world ended", now.state() == v1::INSTANCE_STATE_RUNNING);
  outcome.Try("somebody joined", now.players() == 0);
  return outcome;
}

}  // namespace tessera::support
