#include "bench/attack_seat.h"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <functional>
#include <iostream>
#include <sstream>
#include <utility>

#include "host/program_folder.h"

namespace tessera::bench {
namespace {

volatile std::sig_atomic_t attack_is_over = 0;

struct NamedAttack {
  const char* name;
  std::function<support::Outcome(const AttackSeat&)> run;
  bool again = true;
};

const std::vector<NamedAttack>& Attacks() {
  using Seat = AttackSeat;
  static const std::vector<NamedAttack> attacks = {
      {"methods", [](const Seat& seat) { return support::CallEveryMethod(seat.target); }},
      {"plain", [](const Seat& seat) { return support::SpeakPlainText(seat.target); }},
      {"tokens", [](const Seat& seat) { return support::ShowLongTokens(seat.target, 8, 60U << 20); }},
      {"requests", [](const Seat& seat) { return support::AskAtLength(seat.target, 16, 60U << 20); }},
      {"connections", [](const Seat& seat) { return support::HoldConnections(seat.target, 300, 64); }},
      {"silence", [](const Seat& seat) { return support::SayNothing(seat.target, 100); }},
      {"imports",
       [](const Seat& seat) {
         return support::ImportAsStranger(seat.target, 4, std::size_t{seat.size.import_mb} << 20);
       }},
      {"joins",
       [once = false](const Seat& seat) mutable {
         support::Outcome outcome = support::JoinAndLeave(
             seat.target, seat.world, static_cast<int>(seat.size.join_threads), static_cast<int>(seat.size.joins_each));
         // An address has few guests a second, and another round may come before there is one more.
         if (std::exchange(once, true)) std::erase(outcome.through, support::kNobodyJoined);
         return outcome;
       }},
      {"returns",
       [once = false](const Seat& seat) mutable {
         support::Outcome outcome = support::ReturnAgainAndAgain(
             seat.target, seat.world, static_cast<int>(seat.size.join_threads), static_cast<int>(seat.size.joins_each));
         if (std::exchange(once, true)) std::erase(outcome.through, support::kNobodyJoined);
         return outcome;
       }},
      {"watchers", [](const Seat& seat) { return support::WatchAsStranger(seat.target, seat.world, 10); }, false},
      {"comebacks", [](const Seat& seat) { return support::ComeBackAtTheRegion(seat.target, seat.world, 200); }, false},
      {"tickets", [](const Seat& seat) { return support::ShowWrongTickets(seat.target, seat.world); }, false},
      {"changes", [](const Seat& seat) { return support::ChangeEverything(seat.target, seat.world); }, false},
      {"lies", [](const Seat& seat) { return support::LieAsHost(seat.target, seat.world); }, false},
      {"deaf",
       [](const Seat& seat) {
         return support::NeverRead(seat.target, seat.world, static_cast<int>(seat.size.lease_requests));
       },
       false},
  };
  return attacks;
}

const NamedAttack* FindAttack(const std::string& name) {
  const auto found = std::ranges::find(Attacks(), name, &NamedAttack::name);
  return found == Attacks().end() ? nullptr : &*found;
}

}  // namespace

std::vector<std::string> AttackNames() {
  std::vector<std::string> names;
  for (const NamedAttack& attack : Attacks()) names.emplace_back(attack.name);
  return names;
}

std::vector<std::string> AttackCommand(const AttackSeat& seat) {
  const AttackSize& size = seat.size;
  return {host::ProgramFolder() + "/tessera-bench",
          "attacker",
          seat.name,
          seat.target.socket,
          seat.target.operators,
          seat.target.players,
          seat.world,
          std::to_string(size.import_mb),
          std::to_string(size.lease_requests),
          std::to_string(size.join_threads),
          std::to_string(size.joins_each)};
}

int AttackFromSeat(const AttackSeat& seat) {
  const NamedAttack* const attack = FindAttack(seat.name);
  if (attack == nullptr) return 2;
  const sched_param lowest{};
  if (sched_setscheduler(0, SCHED_IDLE, &lowest) != 0) return 1;  // before there is another thread
  std::signal(SIGTERM, [](int) { attack_is_over = 1; });
  support::Outcome sum;
  do {
    support::Outcome outcome;
    try {
      outcome = attack->run(seat);
    } catch (const std::exception& error) {
      outcome.Try(error.what(), false);
    }
    sum.tries += outcome.tries;
    sum.through.insert(sum.through.end(), outcome.through.begin(), outcome.through.end());
  } while (attack->again && attack_is_over == 0);
  std::cout << fmt::format("tries {}\n", sum.tries);
  for (const std::string& what : sum.through) std::cout << "through " << what << "\n";
  std::cout.flush();
  return 0;
}

support::Outcome ReadOutcome(const std::string& said) {
  support::Outcome outcome;
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("tries ")) outcome.tries = std::stoi(line.substr(6));
    if (line.starts_with("through ")) outcome.through.push_back(line.substr(8));
  }
  return outcome;
}

}  // namespace tessera::bench
