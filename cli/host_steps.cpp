#include "cli/host_steps.h"

#include <fmt/format.h>

namespace tessera::cli {

std::string HostSteps(const std::string& control) {
  return fmt::format(R"(on that machine, as root, with the package tessera-agent:
  install -d -m 0700 /etc/credstore
  (umask 077; cat > /etc/credstore/tessera.join-token)    # paste the token, Ctrl-D
in its /etc/default/tessera-agent, with that machine's ADDRESS and the CONTROL plane's, as others reach them:
  TESSERA_AGENT_FLAGS=--control {0} --advertise-address ADDRESS --metrics-listen ADDRESS:7702
then:
  systemctl enable --now tessera-agent
  rm /etc/credstore/tessera.join-token
only where there is no package, by hand, as a user of its own with a folder of its own:
  TESSERA_JOIN_TOKEN=TOKEN tessera-agent --control {0} --advertise-address ADDRESS --state-dir FOLDER
)",
                     control);
}

}  // namespace tessera::cli
