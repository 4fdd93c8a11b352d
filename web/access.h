// Who may ask: by the host name that was asked for, the page that asks, and a token.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "varlink/json.h"
#include "web/exchange.h"
#include "web/http_server.h"

namespace lensd::web {

/// What a client may do. View: look on and stop what moves. Move: everything that lensd lets lens-web do.
enum class Role { Nobody, View, Move };

/// Immutable once made.
class Access {
 public:
  /// `hosts`: names beside the address itself that requests may ask for. `token_file`: none, and everybody may do
  /// everything, which Code::InvalidArgument refuses where others than this machine can connect. Code::BadData: what
  /// the file says; Code::Io: it cannot be read, or everybody can.
  static Result<Access> Create(const Endpoint& endpoint, const std::vector<std::string>& hosts,
                               const std::optional<std::string>& token_file);

  /// The refusal of a request that asks another host than us (421), comes from another site's page (403), or has
  /// something in its body that a form of another site could send (415).
  std::optional<Answer> Refused(const Exchange& exchange) const;
  /// By `Authorization: Bearer` or the cookie that Greet() sets.
  Role RoleOf(const Exchange& exchange) const;
  Role RoleOfToken(std::string_view token) const;
  bool needs_token() const { return !tokens_.empty(); }
  /// By its token; below owners(). Where none is needed, or it has none, 0.
  std::size_t OwnerOf(const Exchange& exchange) const;
  std::size_t owners() const { return std::max<std::size_t>(tokens_.size(), 1); }

 private:
  struct Token {
    Role role = Role::Nobody;
    std::string text;
  };
  Access() = default;
  Result<void> ReadTokens(const std::string& file);
  bool IsOurs(std::string_view host) const;
  const Token* Find(std::string_view token) const;

  std::vector<std::string> hosts_;  // without ports
  std::vector<Token> tokens_;       // empty: none is needed
};

/// The cookie by which a page that has shown its token goes on.
std::string CookieOf(std::string_view token);

/// May a token that only looks on call this method, with these parameters?
bool IsForViewers(std::string_view method, const varlink::Json& parameters);

}  // namespace lensd::web
