// Roles by the groups that a client belonged to when it connected, as the kernel tells them.
#include "daemon/server/access.h"

#include <grp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

namespace lensd::daemon {
namespace {

bool Shares(const std::vector<gid_t>& some, const std::vector<gid_t>& others) {
  return std::ranges::find_first_of(some, others) != some.end();
}

}  // namespace

std::string_view RoleName(Role role) {
  constexpr std::array<std::string_view, 3> kNames = {"observe", "move", "administer"};
  return kNames.at(static_cast<std::size_t>(role));
}

Credentials CredentialsOf(int socket) {
  Credentials client;
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return client;
  client.user = peer.uid;
  socklen_t bytes = 0;
  (void)getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, nullptr, &bytes);  // ERANGE, with the size that is needed
  client.groups.resize(bytes / sizeof(gid_t));
  if (bytes != 0 && getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, client.groups.data(), &bytes) != 0) {
    client.groups.clear();
  }
  client.groups.push_back(peer.gid);
  return client;
}

Access::Access(AccessConfig config)
    : config_(std::move(config)), move_(Lookup(config_.move)), administer_(Lookup(config_.administer)) {}

std::vector<gid_t> Access::Lookup(const std::vector<std::string>& names) {
  std::vector<gid_t> found;
  for (const std::string& name : names) {
    std::vector<char> room(std::size_t{1} << 16);
    group entry{};
    group* result = nullptr;
    if (getgrnam_r(name.c_str(), &entry, room.data(), room.size(), &result) == 0 && result != nullptr) {
      found.push_back(result->gr_gid);
    } else {
      unknown_.push_back(name);
    }
  }
  return found;
}

Role Access::RoleOf(const Credentials& client) const {
  if (client.user == 0 || client.user == geteuid() || Shares(client.groups, administer_)) return Role::Administer;
  return Shares(client.groups, move_) ? Role::Move : Role::Observe;
}

std::vector<std::string> Access::GroupsFor(Role role) const {
  std::vector<std::string> names = config_.administer;
  if (role != Role::Administer) names.insert(names.begin(), config_.move.begin(), config_.move.end());
  return names;
}

}  // namespace lensd::daemon
