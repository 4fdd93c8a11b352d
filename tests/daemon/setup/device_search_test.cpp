// What the search and those who have a device open say together.
#include "daemon/methods/device_search.h"

#include <gtest/gtest.h>

namespace lensd::daemon {
namespace {

using varlink::Json;

Json OneCamera(const UserOfDevice& user_of) {
  drivers::FoundDevice camera;
  camera.model = "Model";
  camera.serial = "N2";
  camera.config = "serial = \"N2\"";
  camera.camera = true;  // in use, it did not let itself be asked for its lens
  DeviceSearch search;
  search.found.push_back({"aravis", camera});
  const auto reply = varlink::ParseJson(DevicesReply(search, user_of));
  EXPECT_TRUE(reply.has_value());
  return (*reply)["devices"][0];
}

TEST(Devices, ALensThatIsDrivenIsKnownToBeOne) {
  const auto driven = OneCamera([](auto, auto) { return DeviceUser{"ring", true}; });
  EXPECT_EQ(driven["lens"], true);
  EXPECT_EQ(driven["camera"], true);
  EXPECT_EQ(driven["usedBy"], "ring");
  EXPECT_TRUE(driven["config"].get<std::string>().starts_with("[[lens]]\nname = \"ring\"")) << driven["config"];
}

TEST(Devices, ACameraBesideALensStaysOne) {
  const auto beside = OneCamera([](auto, auto) { return DeviceUser{"ring", false}; });
  EXPECT_EQ(beside["lens"], false);
  EXPECT_EQ(beside["usedBy"], "ring");
  EXPECT_TRUE(beside["config"].get<std::string>().starts_with("[lens.camera]")) << beside["config"];
  const auto unused = OneCamera([](auto, auto) { return std::nullopt; });
  EXPECT_EQ(unused["lens"], false);
  EXPECT_TRUE(unused["usedBy"].is_null());
}

}  // namespace
}  // namespace lensd::daemon
