#include "connect_library.h"

#include <dlfcn.h>
#include <tessera/connect.h>

#include <string>
#include <vector>

namespace godot_plugin {

tessera_code GetGrant(const std::string& address, const std::string& instance, const std::string& player,
                      std::vector<std::uint8_t>& grant) {
  void* library = dlopen("libtessera-connect.so.0", RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const std::string why = "address: needs libtessera-connect: " + std::string(dlerror());
    return tessera_set_last_error(TESSERA_FAILED_PRECONDITION, why.c_str());
  }
  const auto get = reinterpret_cast<decltype(&tessera_get_grant)>(dlsym(library, "tessera_get_grant"));
  if (get == nullptr) {
    return tessera_set_last_error(TESSERA_FAILED_PRECONDITION, "address: libtessera-connect is of another version");
  }
  tessera_join_options options = TESSERA_JOIN_OPTIONS;
  options.control_address = address.c_str();
  options.instance_id = instance.c_str();
  options.player_name = player.c_str();
  std::size_t size = 0;
  grant.resize(TESSERA_MAX_GRANT);
  const tessera_code code = get(&options, grant.data(), grant.size(), &size);
  grant.resize(code == TESSERA_OK ? size : 0);
  return code;
}

}  // namespace godot_plugin
