// The attacker that counts is a page of elsewhere in the browser of a user who may move lenses. It cannot forge Host,
// Origin and Sec-Fetch-Site, nor send a JSON body without asking first.
#include "web/access.h"

#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include "proto/errors_and_methods.h"
#include "proto/interfaces.h"

namespace lensd::web {
namespace {

constexpr std::size_t kShortestToken = 32;
constexpr const char* kCookie = "lensd_token";

/// "localhost:8480" without its port, in lower case.
std::string NameOf(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  const bool port = colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos;
  std::string name(port ? host.substr(0, colon) : host);
  for (char& letter : name) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  return name;
}

/// Takes as long whatever the difference is.
bool SameSecret(std::string_view one, std::string_view other) {
  if (one.size() != other.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    difference |= static_cast<unsigned char>(one[i]) ^ static_cast<unsigned char>(other[i]);
  }
  return difference == 0;
}

bool IsTokenText(std::string_view text) {
  return text.size() >= kShortestToken && std::ranges::all_of(text, [](unsigned char letter) {
           return std::isalnum(letter) != 0 || std::strchr("-_.~+/=", letter) != nullptr;
         });
}

bool IsFrom(std::string_view origin, std::string_view host) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (origin.starts_with(scheme) && origin.substr(scheme.size()) == host) return true;
  }
  return false;
}

std::string_view TokenIn(const Exchange& exchange) {
  constexpr std::string_view kBearer = "Bearer ";
  const std::string_view given = exchange.Header("Authorization");
  return given.starts_with(kBearer) ? given.substr(kBearer.size()) : exchange.Cookie(kCookie);
}

}  // namespace

Result<Access> Access::Create(const Endpoint& endpoint, const std::vector<std::string>& hosts,
                              const std::optional<std::string>& token_file) {
  if (!endpoint.loopback && !token_file) {
    return Fail(Code::InvalidArgument, "at " + endpoint.address +
                                           " other machines can connect: name a file of tokens with --token-file, or "
                                           "listen at 127.0.0.1");
  }
  Access access;
  for (const std::string& host : hosts) access.hosts_.push_back(NameOf(host));
  access.hosts_.push_back(endpoint.address);
  if (endpoint.loopback) access.hosts_.insert(access.hosts_.end(), {"localhost", "127.0.0.1", "[::1]"});
  if (!token_file) return access;
  if (auto read = access.ReadTokens(*token_file); !read) return PassOn(read);
  return access;
}

Result<void> Access::ReadTokens(const std::string& file) {
  struct stat found{};
  std::ifstream in(file);
  if (!in || stat(file.c_str(), &found) != 0) {
    return Fail(Code::Io, "the file of tokens " + file + " cannot be read: " + std::strerror(errno));
  }
  if ((found.st_mode & S_IRWXO) != 0) {
    return Fail(Code::Io, "everybody can read the tokens in " + file + ": take that right away with chmod o= " + file);
  }
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string role, token, more;
    if (!(words >> role)) continue;
    words >> token;
    if ((role != "view" && role != "move") || !IsTokenText(token) || words >> more) {
      return Fail(Code::BadData,
                  file + ":" + std::to_string(number) +
                      ": a line is \"view TOKEN\" or \"move TOKEN\", and a token has 32 letters and digits "
                      "or more; make one with: openssl rand -hex 32");
    }
    tokens_.push_back({role == "move" ? Role::Move : Role::View, token});
  }
  if (tokens_.empty()) return Fail(Code::BadData, file + " has no token: nobody could do anything");
  return {};
}

bool Access::IsOurs(std::string_view host) const {
  return std::ranges::find(hosts_, NameOf(host)) != hosts_.end();
}

std::optional<Answer> Access::Refused(const Exchange& exchange) const {
  const std::string_view host = exchange.Header("Host");
  if (!IsOurs(host)) {
    return Refusal(421, "WrongHost", "this is not the host that was asked for; name it with --host where it is");
  }
  const std::string_view origin = exchange.Header("Origin"), site = exchange.Header("Sec-Fetch-Site");
  const bool foreign = (!origin.empty() && !IsFrom(origin, host)) || site == "cross-site" || site == "same-site";
  // A link from elsewhere to the page itself is no harm.
  const bool followed = exchange.Header("Sec-Fetch-Mode") == "navigate" && exchange.method() == "GET" &&
                        exchange.path() == "/" && origin.empty();
  if (foreign && !followed) return Refusal(403, "ForeignOrigin", "pages of other sites may not ask here");
  if (exchange.method() != "POST") return std::nullopt;
  const std::string_view type = exchange.Header("Content-Type");
  if (type.substr(0, type.find(';')) != "application/json") {
    return Refusal(415, "NotJson", "the body of a call is JSON: send Content-Type: application/json");
  }
  return std::nullopt;
}

/// Of equal tokens the one that may do the most; null: none. Takes as long whichever it is.
const Access::Token* Access::Find(std::string_view token) const {
  const Token* found = nullptr;
  for (const Token& known : tokens_) {
    if (SameSecret(known.text, token) && (found == nullptr || found->role < known.role)) found = &known;
  }
  return found;
}

Role Access::RoleOfToken(std::string_view token) const {
  if (!needs_token()) return Role::Move;
  const Token* found = Find(token);
  return found == nullptr ? Role::Nobody : found->role;
}

Role Access::RoleOf(const Exchange& exchange) const {
  return RoleOfToken(TokenIn(exchange));
}

std::size_t Access::OwnerOf(const Exchange& exchange) const {
  const Token* found = Find(TokenIn(exchange));
  return found == nullptr ? 0 : static_cast<std::size_t>(found - tokens_.data());
}

std::string CookieOf(std::string_view token) {
  return std::string(kCookie) + "=" + std::string(token) + "; Path=/; HttpOnly; SameSite=Strict";
}

bool IsForViewers(std::string_view method, const varlink::Json& parameters) {
  const auto* row = std::ranges::find_if(proto::kMethods, [&](const proto::MethodRow& known) {
    return known.interface == proto::kLensInterface && known.name == method;
  });
  if (row == std::end(proto::kMethods)) return false;
  if (row->needs_lease == proto::NeedsLease::ToApply)
    return !parameters.contains("apply") || parameters["apply"] == false;
  return row->role == proto::Role::Observe;
}

}  // namespace lensd::web
