// Attacks on a running cluster from outside, as strangers, players and a host with a valid certificate would make them.
// Tests and the benchmark of trust use the same.
//
//   const Target target{.socket = ..., .operators = "127.0.0.1:7700#FINGERPRINT", ...};
//   const Outcome outcome = CallEveryMethod(target);   // outcome.through: what should have been refused, and was not
//
// Each attack returns once it is over, and bounds its own time. Thread rule: any thread; each uses threads of its own.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace tessera::support {

struct Target {
  std::string socket;              // the control plane's, as this user: to set a stage and to look
  std::string operators, players;  // HOST:PORT#FINGERPRINT
};

struct Outcome {
  int tries = 0;
  std::vector<std::string> through;  // a line for each try that got through
  void Try(const std::string& what, bool refused) {
    ++tries;
    if (!refused) through.push_back(what);
  }
};

// Every method of every service, at both doors, with nothing to show; at the players' door all but what players call.
Outcome CallEveryMethod(const Target& target);
// So many hellos at once, each with a join token of so many bytes.
Outcome ShowLongTokens(const Target& target, int streams, std::size_t bytes);
// So many calls at once of methods that strangers may try, each with a request of so many bytes.
Outcome AskAtLength(const Target& target, int calls, std::size_t bytes);
// So many streams that say nothing, until the control plane has ended them.
Outcome SayNothing(const Target& target, int streams);
// So many imports at once, of so many bytes each, without a token.
Outcome ImportAsStranger(const Target& target, int imports, std::size_t bytes);
// So many connections from one address at each door, which say nothing. Through are more than `most` that stay at one,
// and others who are kept out of it.
Outcome HoldConnections(const Target& target, int at_each_door, int most);
// No TLS.
Outcome SpeakPlainText(const Target& target);
// So many guests' joins and leaves, by so many threads. Through is what is left in the world, and that nobody joined.
inline constexpr char kNobodyJoined[] = "nobody could join";
Outcome JoinAndLeave(const Target& target, const std::string& instance, int threads, int times_each);
// One guest joins, and comes back by its credential so often, by so many threads. Through are more returns than one
// player's rate, and a guest who is left in the world.
Outcome ReturnAgainAndAgain(const Target& target, const std::string& instance, int threads, int times_each);
// One guest joins, leaves, and dials a region by its grant so often. Through are a welcome, a refusal without a reason,
// and more logins that a region looks at than its limits say (net/limits.h).
Outcome ComeBackAtTheRegion(const Target& target, const std::string& instance, int times);
// Tickets of another cluster, of yesterday, of tomorrow, of an unknown issuer, and a copy of one that was good.
Outcome ShowWrongTickets(const Target& target, const std::string& instance);
// So many viewers from the players' door, and as many by the socket: regions keep places for the latter
// (viewer_number.h).
Outcome WatchAsStranger(const Target& target, const std::string& instance, int viewers);

// A viewer's token calls every method that changes something, and an operator's for another instance every one that
// changes something or concerns this instance.
Outcome ChangeEverything(const Target& target, const std::string& instance);

// Admits a host by TLS, and has it lie: about its capacity, about players, about another's workers and their keys; it
// asks for the scene, game and state of a world that it has no part in, and sends a checkpoint of it.
Outcome LieAsHost(const Target& target, const std::string& instance);
// The same kind of host has a region of a second world, asks for its lease so often, and reads no answer meanwhile.
Outcome NeverRead(const Target& target, const std::string& instance, int requests);

// Seconds that an operator's list of hosts takes at the socket; below 0: it failed.
double OperatorsCallSeconds(const Target& target);
// The same at the operators' door by TLS, with an access token, from the connection's beginning.
double OperatorsCallSecondsAtDoor(const Target& target, const std::string& token);
// Resident memory of a process, MB; and the part of it that is of no file, as its heap and stacks are.
double ResidentMegabytes(pid_t pid);
double AnonymousMegabytes(pid_t pid);
// The highest that it was since the last ForgetHighest, as the kernel counts it. False: this kernel does not forget.
bool ForgetHighest(pid_t pid);
double HighestMegabytes(pid_t pid);

}  // namespace tessera::support
