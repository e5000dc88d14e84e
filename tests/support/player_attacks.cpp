// Attacks of players, at the players' door.
#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <random>
#include <string>

#include "core/world/viewer_number.h"
#include "local_cluster/command_error.h"
#include "tessera/v1/access.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"
#include "tests/support/attack_calls.h"
#include "tests/support/attacks.h"
#include "trust/ticket.h"

namespace tessera::support {
namespace {

// A player comes back so often at once, and once a second from then on.
constexpr double kReturnsAtOnce = 5, kReturnsPerSecond = 1;
constexpr std::chrono::hours kDay{24};

grpc::Status Join(v1::SessionService::Stub& stub, const v1::JoinInstanceRequest& request,
                  v1::JoinInstanceResponse& grant) {
  grpc::ClientContext context;
  context.set_deadline(Soon());
  return stub.JoinInstance(&context, request, &grant);
}

grpc::Status Leave(v1::SessionService::Stub& stub, const std::string& instance, const v1::JoinInstanceResponse& grant) {
  v1::LeaveInstanceRequest request;
  request.set_instance_id(instance);
  request.set_credential(grant.credential());
  request.set_credential_key(grant.credential_key());
  v1::LeaveInstanceResponse gone;
  grpc::ClientContext context;
  context.set_deadline(Soon());
  return stub.LeaveInstance(&context, request, &gone);
}

void TryNobodyIsLeft(const Target& target, const std::string& instance, Outcome& outcome) {
  const v1::Instance now = GetInstance(target, instance);
  outcome.Try(fmt::format("{} players are left in the world", now.players()), now.players() == 0);
  outcome.Try("the world ended", now.state() == v1::INSTANCE_STATE_RUNNING);
}

trust::TicketSeed DrawSeed() {
  std::random_device device;
  trust::TicketSeed seed{};
  std::generate(seed.begin(), seed.end(), [&] { return static_cast<std::uint8_t>(device()); });
  return seed;
}

// A ticket of now for this cluster, by an issuer that is believed from here on.
trust::Ticket TicketOf(const Target& target, const trust::TicketSeed& seed) {
  v1::AddIssuerRequest request;
  request.set_name("attacked");
  const trust::TicketPublicKey key = trust::PublicKeyOf(seed);
  request.set_public_key(key.data(), key.size());
  v1::AddIssuerResponse added;
  grpc::ClientContext context;
  const grpc::Status status =
      v1::AccessService::NewStub(DialAlone(target.socket))->AddIssuer(&context, request, &added);
  trust::Ticket ticket;
  if (!status.ok() || added.cluster_id().size() != ticket.cluster.size()) {
    throw local::CommandError("issuer add: " + status.error_message());
  }
  std::copy(added.cluster_id().begin(), added.cluster_id().end(), ticket.cluster.begin());
  ticket.issued_at = std::chrono::floor<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch());
  ticket.number = 1;
  ticket.player_id = "ada";
  return ticket;
}

}  // namespace

Outcome JoinAndLeave(const Target& target, const std::string& instance, int threads, int times_each) {
  Outcome outcome;
  std::atomic<int> joined = 0, left = 0;
  InParallel(threads, [&](int) {
    const auto stub = v1::SessionService::NewStub(DialAlone(target.players));
    for (int i = 0; i < times_each; ++i) {
      v1::JoinInstanceRequest join;
      join.set_instance_id(instance);
      v1::JoinInstanceResponse grant;
      if (!Join(*stub, join, grant).ok()) continue;
      ++joined;
      left += Leave(*stub, instance, grant).ok() ? 1 : 0;
    }
  });
  outcome.Try(kNobodyJoined, joined > 0);
  outcome.Try(fmt::format("{} of {} who joined could not leave", joined - left, joined.load()), joined == left);
  TryNobodyIsLeft(target, instance, outcome);
  return outcome;
}

Outcome ReturnAgainAndAgain(const Target& target, const std::string& instance, int threads, int times_each) {
  Outcome outcome;
  const auto first = v1::SessionService::NewStub(DialAlone(target.players));
  v1::JoinInstanceRequest join;
  join.set_instance_id(instance);
  v1::JoinInstanceResponse grant;
  const bool joined = Join(*first, join, grant).ok();
  outcome.Try(kNobodyJoined, joined);
  if (!joined) return outcome;
  // Any credential that a player ever had will do.
  join.set_credential(grant.credential());
  join.set_credential_key(grant.credential_key());
  std::atomic<int> came = 0;
  std::mutex mutex;
  const auto begin = std::chrono::steady_clock::now();
  InParallel(threads, [&](int) {
    const auto stub = v1::SessionService::NewStub(DialAlone(target.players));
    for (int i = 0; i < times_each; ++i) {
      v1::JoinInstanceResponse again;
      const grpc::Status status = Join(*stub, join, again);
      if (status.ok()) {
        ++came;
        continue;
      }
      const std::lock_guard lock(mutex);
      outcome.Try("a return is refused as none: " + status.error_message(),
                  status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED);
    }
  });
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  outcome.Try("nobody could come back", came > 0);
  outcome.Try(fmt::format("one player came back {} times within {:.1f} s", came.load(), took.count()),
              came <= kReturnsAtOnce + std::ceil(kReturnsPerSecond * took.count()));
  outcome.Try("an operator waits", OperatorsCallSeconds(target) >= 0);
  outcome.Try("who came back could not leave", Leave(*first, instance, grant).ok());
  TryNobodyIsLeft(target, instance, outcome);
  return outcome;
}

Outcome ShowWrongTickets(const Target& target, const std::string& instance) {
  Outcome outcome;
  const trust::TicketSeed seed = DrawSeed();
  const trust::Ticket good = TicketOf(target, seed);
  const auto stub = v1::SessionService::NewStub(DialAlone(target.players));
  v1::JoinInstanceResponse grant;
  const auto show = [&](const std::string& text) {
    v1::JoinInstanceRequest join;
    join.set_instance_id(instance);
    join.set_ticket(text);
    return Join(*stub, join, grant);
  };
  const auto attempt = [&](const char* what, const std::string& text) {
    const grpc::Status status = show(text);
    outcome.Try(
        fmt::format("{}: {}", what, status.error_message()),
        status.error_code() == grpc::StatusCode::UNAUTHENTICATED && status.error_message().starts_with("ticket: "));
  };
  trust::Ticket wrong = good;
  wrong.cluster[0] ^= 1;
  attempt("a ticket of another cluster", local::OrThrow(trust::SignTicket(wrong, seed)));
  wrong = good;
  wrong.issued_at -= kDay;
  attempt("a ticket of yesterday", local::OrThrow(trust::SignTicket(wrong, seed)));
  wrong.issued_at = good.issued_at + kDay;
  attempt("a ticket of tomorrow", local::OrThrow(trust::SignTicket(wrong, seed)));
  attempt("a ticket of nobody's", local::OrThrow(trust::SignTicket(good, DrawSeed())));
  const std::string text = local::OrThrow(trust::SignTicket(good, seed));
  const grpc::Status came = show(text);
  outcome.Try("no ticket is taken: " + came.error_message(), came.ok());
  const v1::JoinInstanceResponse kept = grant;
  attempt("a copy", text);
  outcome.Try("who came by a ticket could not leave", Leave(*stub, instance, kept).ok());
  TryNobodyIsLeft(target, instance, outcome);
  return outcome;
}

Outcome WatchAsStranger(const Target& target, const std::string& instance, int viewers) {
  Outcome outcome;
  const auto strangers = v1::SessionService::NewStub(DialAlone(target.players));
  const auto trusted = v1::SessionService::NewStub(DialAlone(target.socket));
  v1::JoinInstanceRequest watch;
  watch.set_instance_id(instance);
  watch.set_viewer(true);
  v1::JoinInstanceResponse grant;
  for (int i = 0; i < viewers; ++i) {
    const grpc::Status strange = Join(*strangers, watch, grant);
    outcome.Try(fmt::format("viewer {} {} passes for a gateway", grant.player(), strange.error_message()),
                strange.ok() && IsStrangersViewer(PlayerNumber(grant.player())));
    const grpc::Status known = Join(*trusted, watch, grant);
    const PlayerNumber number(grant.player());
    outcome.Try(fmt::format("viewer {} {} passes for a stranger", number.value(), known.error_message()),
                known.ok() && IsViewer(number) && !IsStrangersViewer(number));
  }
  return outcome;
}

}  // namespace tessera::support
