#include "control_plane/bounded_service.h"

#include <google/protobuf/descriptor.h>
#include <grpc/byte_buffer.h>
#include <grpc/byte_buffer_reader.h>
#include <grpc/slice.h>

#include <cassert>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/door_limits.h"
#include "control_plane/message_cost.h"

namespace tessera::control {
namespace {

using grpc::internal::MethodHandler;
using grpc::internal::RpcMethod;

// gRPC's own handler of a method, behind the limit.
class BoundedHandler final : public MethodHandler {
 public:
  BoundedHandler(MethodHandler& handler, const google::protobuf::Descriptor& request, std::string method,
                 const BoundedService::Refused& on_refused)
      : handler_(handler),
        request_(request),
        method_(std::move(method)),
        limit_(RequestLimit(method_)),
        on_refused_(on_refused) {}

  void RunHandler(const HandlerParameter& param) override {
    if (param.status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED) {
      on_refused_(*static_cast<grpc::ServerContext*>(param.server_context), method_, param.status);
    }
    handler_.RunHandler(param);  // which answers with that status
  }
  // It owns `request`. Null: there is none, or it is refused.
  void* Deserialize(grpc_call* call, grpc_byte_buffer* request, grpc::Status* status, void** handler_data) override {
    const std::size_t has = request == nullptr ? 0 : grpc_byte_buffer_length(request);
    const bool is_small = has <= limit_;
    if (is_small && (request == nullptr || IsCheap(request))) {
      return handler_.Deserialize(call, request, status, handler_data);
    }
    grpc_byte_buffer_destroy(request);
    *status = {grpc::StatusCode::RESOURCE_EXHAUSTED,
               is_small ? absl::StrCat(method_, ": the request would take more than 256 MiB of memory")
                        : absl::StrCat(method_, ": the request has ", has, " bytes, at most ", limit_)};
    return nullptr;
  }

 private:
  bool IsCheap(grpc_byte_buffer* request) const {
    grpc_byte_buffer_reader reader;
    if (grpc_byte_buffer_reader_init(&reader, request) == 0) return true;  // nor can it be parsed
    const grpc_slice bytes = grpc_byte_buffer_reader_readall(&reader);
    grpc_byte_buffer_reader_destroy(&reader);
    const bool is_cheap =
        TakesAtMost({reinterpret_cast<const char*>(GRPC_SLICE_START_PTR(bytes)), GRPC_SLICE_LENGTH(bytes)}, request_,
                    kMaxParsedBytes);
    grpc_slice_unref(bytes);
    return is_cheap;
  }

  MethodHandler& handler_;
  const google::protobuf::Descriptor& request_;
  const std::string method_;
  const std::size_t limit_;
  const BoundedService::Refused& on_refused_;
};

// gRPC lets derived classes alone ask for handlers.
struct Handlers : grpc::Service {
  static MethodHandler& At(grpc::Service& service, int index) { return *(service.*(&Handlers::GetHandler))(index); }
};

RpcMethod::RpcType TypeOf(const google::protobuf::MethodDescriptor& method) {
  if (method.client_streaming()) {
    return method.server_streaming() ? RpcMethod::BIDI_STREAMING : RpcMethod::CLIENT_STREAMING;
  }
  return method.server_streaming() ? RpcMethod::SERVER_STREAMING : RpcMethod::NORMAL_RPC;
}

}  // namespace

// Generated services add their methods in the order of the .proto.
BoundedService::BoundedService(grpc::Service& service, const std::string& full_name, Refused on_refused,
                               StreamHandlers streams)
    : on_refused_(std::move(on_refused)) {
  const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(full_name);
  assert(descriptor != nullptr);
  for (int i = 0; i < descriptor->method_count(); ++i) {
    const google::protobuf::MethodDescriptor& method = *descriptor->method(i);
    const std::string& path = paths_.emplace_back(absl::StrCat("/", full_name, "/", method.name()));
    const std::string name = absl::StrCat(descriptor->name(), "/", method.name());
    MethodHandler* handler = nullptr;  // owned by the method
    if (method.client_streaming()) {
      handler = streams.at(method.name()).release();
    } else {
      handler = new BoundedHandler(Handlers::At(service, i), *method.input_type(), name, on_refused_);
    }
    AddMethod(new grpc::internal::RpcServiceMethod(path.c_str(), TypeOf(method), handler));
  }
}

}  // namespace tessera::control
