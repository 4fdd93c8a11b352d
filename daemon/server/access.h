// Who may do what: every method asks for a role, and a client has the highest that its user and its groups give it.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>
#include <vector>

#include "proto/rows.h"

namespace lensd::daemon {

using proto::Role;
/// "observe", "move", "administer".
std::string_view RoleName(Role role);

/// [access] of the configuration: names of the groups whose members have a role.
struct AccessConfig {
  std::vector<std::string> move = {"lens"};
  std::vector<std::string> administer = {"lens-admin"};
};

/// A client as the kernel knew it when it connected.
struct Credentials {
  uid_t user = static_cast<uid_t>(-1);
  std::vector<gid_t> groups;  ///< the first one and the supplementary ones (SO_PEERGROUPS)
};
/// Of the peer of a Unix socket; where the kernel does not tell, of a user without rights.
Credentials CredentialsOf(int socket);

/// From the event loop's thread.
class Access {
 public:
  /// Looks the groups up, once. A group that this machine does not have gives no client a role.
  explicit Access(AccessConfig config = {});
  /// Root and the daemon's own user administer.
  Role RoleOf(const Credentials& client) const;
  /// Names of the groups that give a role, those of higher roles included.
  std::vector<std::string> GroupsFor(Role role) const;
  /// Names in the configuration that this machine does not have.
  const std::vector<std::string>& unknown() const { return unknown_; }

 private:
  std::vector<gid_t> Lookup(const std::vector<std::string>& names);

  AccessConfig config_;
  std::vector<std::string> unknown_;
  std::vector<gid_t> move_;
  std::vector<gid_t> administer_;
};

}  // namespace lensd::daemon
