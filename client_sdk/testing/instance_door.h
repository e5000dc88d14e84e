// InstanceDoor: the players' door in JSON of a FakeInstance, at the socket beside its own or by TLS (fake_tls.h). It
// reads requests and writes answers as the control plane does.
//
// Thread rule: that of FakeDoor.
#pragma once

#include <string>
#include <utility>

#include "client_sdk/testing/fake_door.h"
#include "client_sdk/testing/fake_instance.h"
#include "control_plane/join_page.h"
#include "host/json_socket.h"

namespace tessera::client {

class InstanceDoor {
 public:
  explicit InstanceDoor(FakeInstance& instance)
      : door_(host::JsonSocket(instance.address.substr(sizeof "unix:" - 1)), AnswererOf(instance)) {}
  InstanceDoor(FakeInstance& instance, FakeDoor::Opener opener) : door_(std::move(opener), AnswererOf(instance)) {}

  std::string address() const { return door_.address(); }  // HOST:PORT of one by TLS

 private:
  static FakeDoor::Answerer AnswererOf(FakeInstance& instance) {
    return [&instance](const std::string& path, const std::string& body) {
      const control::PageAnswer answer = AnswerOf(instance, path, body);
      return FakeDoor::Http(answer.status, answer.body);
    };
  }
  static absl::Status StatusFrom(const grpc::Status& status) {
    return {static_cast<absl::StatusCode>(status.error_code()), status.error_message()};
  }
  static control::PageAnswer AnswerOf(FakeInstance& instance, const std::string& path, const std::string& body) {
    if (path == "/v1/join") {
      const auto request = control::ReadJoinBody(body);
      if (!request.ok()) return control::ErrorAnswer(request.status());
      v1::JoinInstanceResponse response;
      const absl::Status status = StatusFrom(instance.JoinInstance(nullptr, &*request, &response));
      if (!status.ok()) return control::ErrorAnswer(status);
      return control::JoinAnswer(request->instance_id(), response);
    }
    if (path == "/v1/leave") {
      const auto request = control::ReadLeaveBody(body);
      if (!request.ok()) return control::ErrorAnswer(request.status());
      v1::LeaveInstanceResponse response;
      return control::LeaveAnswer(StatusFrom(instance.LeaveInstance(nullptr, &*request, &response)));
    }
    const absl::Status status = control::CheckListBody(body);
    return status.ok() ? control::ListAnswer(instance.list.instances) : control::ErrorAnswer(status);
  }

  FakeDoor door_;
};

}  // namespace tessera::client
