// Connection: the stubs of one control plane, and how its errors become the command line's.
//
// Every call has a deadline. A failed one throws CommandError with the one line a person needs. Of this header gRPC's
// come in, which take seconds to compile: headers name Connection without it.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>

#include "local_cluster/command_error.h"
#include "tessera/v1/access.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/visuals.grpc.pb.h"
#include "trust/credentials.h"

namespace tessera::local {

class Connection {
 public:
  // CommandError: the address is of no form that trust::Dial takes, or what answers there is not to be trusted. At an
  // address without a fingerprint nothing is dialled before the first call.
  explicit Connection(const trust::ControlPoint& control);

  v1::AccessService::Stub& access() { return *access_; }
  v1::HostService::Stub& hosts() { return *hosts_; }
  v1::InstanceService::Stub& instances() { return *instances_; }
  v1::VisualService::Stub& visuals() { return *visuals_; }

  // One call with a deadline; its answer. Throws as Check does.
  //   auto answer = connection.Call("host add", connection.hosts(), &v1::HostService::Stub::AddHost, request);
  template <class Stub, class Request, class Response>
  Response Call(const std::string& what, Stub& stub,
                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*), const Request& request,
                std::chrono::milliseconds timeout = std::chrono::seconds(10)) const {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + timeout);
    Response response;
    Check((stub.*method)(&context, request, &response), what);
    return response;
  }

  // The same for a call that takes `bytes` in pieces of at most `piece_bytes`: `first` is a piece without data, whose
  // other fields go with the first one alone.
  template <class Stub, class Piece, class Response>
  Response Send(const std::string& what, Stub& stub,
                std::unique_ptr<grpc::ClientWriter<Piece>> (Stub::*method)(grpc::ClientContext*, Response*),
                const Piece& first, const std::string& bytes, std::size_t piece_bytes,
                std::chrono::milliseconds timeout) const {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + timeout);
    Response response;
    const auto stream = (stub.*method)(&context, &response);
    Piece piece = first;
    for (std::size_t at = 0; at < bytes.size(); at += piece_bytes) {
      piece.set_data(bytes.substr(at, piece_bytes));
      if (!stream->Write(piece)) break;  // refused, or there already: the status says
      piece.Clear();
    }
    stream->WritesDone();
    Check(stream->Finish(), what);
    return response;
  }

  // Throws unless ok: "<what>: <message> (NOT_FOUND)", or where the control plane cannot be reached, the address
  // and what to do.
  void Check(const grpc::Status& status, const std::string& what) const;

 private:
  std::string address_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::AccessService::Stub> access_;
  std::unique_ptr<v1::HostService::Stub> hosts_;
  std::unique_ptr<v1::InstanceService::Stub> instances_;
  std::unique_ptr<v1::VisualService::Stub> visuals_;
};

const char* CodeName(grpc::StatusCode code);

}  // namespace tessera::local
