// BoundedReader: the messages of a client's stream, each measured before it is parsed.
//
//   BoundedReader<v1::ImportCheckpointRequest> reader(stream, StreamMessageLimit("InstanceService/ImportCheckpoint"));
//   while (reader.Read(&piece)) ...
//   if (!reader.status().ok()) return reader.status();   // "a message of the stream has 2000000 bytes, ..."
//
// The method takes its messages as bytes, so BoundedService (bounded_service.h) is to have its handler.
//
// Thread rule: one thread; as the stream.
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "control_plane/message_cost.h"
#include "control_plane/stream_deadlines.h"

namespace tessera::control {

template <class Message>
class BoundedReader {
 public:
  using Stream = grpc::internal::ReaderInterface<grpc::ByteBuffer>;
  // `most`: bytes of one message; what each of its fields takes in memory may have a limit of its own. The stream
  // outlives it.
  BoundedReader(Stream& stream, std::size_t most, LimitOfField limit_of = {})
      : stream_(stream), most_(most), limit_of_(std::move(limit_of)) {}

  // Each message has to come in time, else `cancel` ends the stream. Both outlive it.
  void Expect(StreamDeadlines& deadlines, std::function<void()> cancel) {
    deadlines_ = &deadlines;
    cancel_ = std::move(cancel);
  }

  // False: the stream is over, or status() says why no more is read.
  bool Read(Message* message) {
    grpc::ByteBuffer bytes;
    if (!status_.ok() || !Await(bytes)) return false;
    bytes_ = bytes.Length();
    status_ = Check(bytes);
    if (status_.ok() && !grpc::SerializationTraits<Message>::Deserialize(&bytes, message).ok()) {
      status_ = absl::InvalidArgumentError("a message of the stream cannot be read");
    }
    return status_.ok();
  }
  const absl::Status& status() const { return status_; }
  std::size_t bytes() const { return bytes_; }  // the last message's

 private:
  bool Await(grpc::ByteBuffer& bytes) {
    if (deadlines_ == nullptr) return stream_.Read(&bytes);
    const std::unique_ptr<StreamDeadlines::Waiting> waiting = deadlines_->Begin(cancel_);
    if (!waiting) {
      status_ = absl::ResourceExhaustedError("too many streams are under way; try again");
      return false;
    }
    const bool came = stream_.Read(&bytes);
    if (!waiting->End()) status_ = absl::DeadlineExceededError("the stream's next message did not come in time");
    return came && status_.ok();
  }
  absl::Status Check(grpc::ByteBuffer& bytes) const {
    const std::size_t has = bytes.Length();
    if (has > most_) {
      return absl::ResourceExhaustedError(absl::StrCat("a message of the stream has ", has, " bytes, at most ", most_));
    }
    grpc::ProtoBufferReader reader(&bytes);
    const bool is_cheap = limit_of_ ? FieldsTakeAtMost(reader, *Message::descriptor(), limit_of_)
                                    : TakesAtMost(reader, *Message::descriptor(), kMaxParsedBytes);
    if (is_cheap) return absl::OkStatus();
    return absl::ResourceExhaustedError("a message of the stream would take too much memory");
  }

  Stream& stream_;
  const std::size_t most_;
  const LimitOfField limit_of_;
  StreamDeadlines* deadlines_ = nullptr;
  std::function<void()> cancel_;
  absl::Status status_;
  std::size_t bytes_ = 0;
};

}  // namespace tessera::control
