#include "tests/support/attack_calls.h"

#include <google/protobuf/descriptor.h>
#include <grpcpp/generic/generic_stub.h>

#include "local_cluster/command_error.h"
#include "tessera/v1/access.grpc.pb.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"
#include "tessera/v1/visuals.grpc.pb.h"
#include "trust/dial.h"

namespace tessera::support {

std::shared_ptr<grpc::Channel> DialAlone(const std::string& address, const trust::Credentials& credentials) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return local::OrThrow(trust::Dial(address, credentials, arguments));
}

grpc::Status CallByName(const std::shared_ptr<grpc::Channel>& channel, const std::string& name,
                        const std::string& request) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  context.set_deadline(Soon());
  const auto call = stub.PrepareCall(&context, name, &queue);
  const auto await = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  await();
  const grpc::Slice slice(request);
  call->WriteLast(grpc::ByteBuffer(&slice, 1), {}, nullptr);
  await();
  grpc::ByteBuffer answer;  // without reading it, one that is given would not end
  call->Read(&answer, nullptr);
  await();
  grpc::Status status;
  call->Finish(&status, nullptr);
  await();
  return status;
}

std::vector<std::string> AllMethodNames() {
  std::vector<std::string> names{"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                 "/grpc.health.v1.Health/Watch", kHealthCheck, "/tessera.v1.NoService/NoMethod"};
  for (const google::protobuf::FileDescriptor* file :
       {v1::CreateTokenRequest::descriptor()->file(), v1::AgentHello::descriptor()->file(),
        v1::Host::descriptor()->file(), v1::Instance::descriptor()->file(),
        v1::JoinInstanceRequest::descriptor()->file(), v1::PutVisualRequest::descriptor()->file()}) {
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        names.push_back("/" + file->service(s)->full_name() + "/" + file->service(s)->method(m)->name());
      }
    }
  }
  return names;
}

bool IsRefusal(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::UNAUTHENTICATED ||
         status.error_code() == grpc::StatusCode::PERMISSION_DENIED;
}

v1::Instance GetInstance(const Target& target, const std::string& id) {
  v1::GetInstanceRequest request;
  request.set_id(id);
  v1::GetInstanceResponse response;
  grpc::ClientContext context;
  (void)v1::InstanceService::NewStub(DialAlone(target.socket))->GetInstance(&context, request, &response);
  return response.instance();
}

}  // namespace tessera::support
