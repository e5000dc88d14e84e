#include "tests/support/knocks.h"

#include <algorithm>
#include <map>
#include <memory>

#include "absl/strings/str_cat.h"
#include "core/world/byte_view.h"
#include "local_cluster/command_error.h"
#include "net/endpoint.h"

namespace tessera::support {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{2}, kFarewell{500};

// The answer that a message is; nothing: it is none, and another follows.
std::optional<Knocked> AnswerIn(const Knock& knock, const net::Event& event) {
  if (event.delivery != net::Delivery::kReliable) return std::nullopt;
  const auto size = static_cast<int>(event.bytes.size());
  if (knock.hello) {
    v1::LinkHello hello;
    if (!hello.ParseFromArray(event.bytes.data(), size)) return std::nullopt;
    return Knocked{.answer = Knocked::Answer::kOpened, .said = absl::StrCat("a link to region ", hello.region())};
  }
  v1::RegionControl control;
  if (!control.ParseFromArray(event.bytes.data(), size)) return std::nullopt;
  if (control.has_welcome()) {
    return Knocked{.answer = Knocked::Answer::kOpened,
                   .said = absl::StrCat("a welcome to region ", control.welcome().region())};
  }
  if (control.has_refusal()) {
    return Knocked{
        .answer = Knocked::Answer::kRefused,
        .said = absl::StrCat(v1::RefusalReason_Name(control.refusal().reason()), ": ", control.refusal().detail())};
  }
  return std::nullopt;
}

Knocked RefusedBy(const net::Event& event) {
  Knocked refused{.answer = Knocked::Answer::kRefused};
  if (!event.refusal) return refused;
  refused.said = absl::StrCat(std::string(net::WordOf(event.refusal->reason)), ": ", event.refusal->detail);
  refused.by_acceptor = event.refusal->reason;
  return refused;
}

// The endpoint and its knocks that wait for their answers.
class KnockRound {
 public:
  explicit KnockRound(const std::vector<Knock>& knocks)
      : knocks_(knocks),
        answers_(knocks.size()),
        endpoint_(local::OrThrow(net::Endpoint::Create({.max_peers = std::max<std::size_t>(knocks.size(), 1)}))) {
    for (std::size_t i = 0; i < knocks_.size(); ++i) {
      const Knock& knock = knocks_[i];
      const auto peer = endpoint_->Connect(knock.host, knock.port, knock.region, knock.least, knock.credentials);
      waiting_.emplace(local::OrThrow(peer), i);
    }
  }

  std::vector<Knocked> Answers(std::chrono::milliseconds patience) {
    const auto over = Clock::now() + patience;
    while (!waiting_.empty() && Clock::now() < over) {
      for (const net::Event& event : endpoint_->Service(kLook)) Take(event);
    }
    for (const auto& [peer, index] : waiting_) endpoint_->Disconnect(peer);
    const auto gone = Clock::now() + kFarewell;
    while (endpoint_->connections() > 0 && Clock::now() < gone) endpoint_->Service(kLook);
    return std::move(answers_);
  }

 private:
  void Take(const net::Event& event) {
    const auto found = waiting_.find(event.peer);
    if (found == waiting_.end()) return;
    const Knock& knock = knocks_[found->second];
    if (event.kind == net::Event::Kind::kConnected && knock.hello) {
      const std::string hello = knock.hello->SerializeAsString();
      (void)endpoint_->Send(event.peer, net::Delivery::kReliable, AsBytes(hello));  // gone again: its end follows
    } else if (event.kind == net::Event::Kind::kDisconnected) {
      answers_[found->second] = RefusedBy(event);
      waiting_.erase(found);
    } else if (event.kind == net::Event::Kind::kMessage) {
      const std::optional<Knocked> answer = AnswerIn(knock, event);
      if (!answer) return;
      answers_[found->second] = *answer;
      endpoint_->Disconnect(event.peer);
      waiting_.erase(found);
    }
  }

  const std::vector<Knock>& knocks_;
  std::vector<Knocked> answers_;
  const std::unique_ptr<net::Endpoint> endpoint_;
  std::map<net::PeerHandle, std::size_t> waiting_;
};

}  // namespace

std::vector<Knocked> KnockAll(const std::vector<Knock>& knocks, std::chrono::milliseconds patience) {
  return KnockRound(knocks).Answers(patience);
}

}  // namespace tessera::support
