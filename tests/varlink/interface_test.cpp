// Parsing interface definitions, and the promise that io.lensd.Lens documents everything it defines.
#include <gtest/gtest.h>

#include "proto/interfaces.h"
#include "varlink/interface_definition.h"

namespace lensd::varlink {
namespace {

std::optional<std::string> Wrong(const InterfaceDefinition& definition, const char* parameters) {
  return definition.FirstWrong(*definition.methods().find("M")->second.input,
                               Document::Parse(parameters).value().root());
}

TEST(InterfaceDefinition, NamesTheFirstParameterThatIsWrong) {
  const auto definition = InterfaceDefinition::Parse(R"(
# A comment.
interface a.b
type Colour (red, green)
type Point (x: float, y: float)
method M(n: int, flag: ?bool, colour: ?Colour, at: ?Point, list: ?[]?Point, map: ?[string]int, any: ?object) -> ()
error E (why: string)
)")
                              .value();
  EXPECT_EQ(definition.name(), "a.b");
  EXPECT_EQ(definition.errors().size(), 1u);
  const std::pair<const char*, const char*> cases[] = {
      {R"({"n":1})", nullptr},
      {R"({"n":1,"flag":null,"at":{"x":1,"y":2.5},"list":[null,{"x":0,"y":0}],"map":{"k":1},"any":{}})", nullptr},
      {R"({})", "n"},
      {R"({"n":null})", "n"},
      {R"({"n":1.5})", "n"},
      {R"({"n":"1"})", "n"},
      {R"({"n":1,"flag":0})", "flag"},
      {R"({"n":1,"colour":"blue"})", "colour"},
      {R"({"n":1,"at":{"x":1}})", "at.y"},
      {R"({"n":1,"at":{"x":1,"y":2,"z":3}})", "at.z"},
      {R"({"n":1,"at":[1,2]})", "at"},
      {R"({"n":1,"list":[{"x":1,"y":"2"}]})", "list[0].y"},
      {R"({"n":1,"map":{"k":1.5}})", "map"},
      {R"({"n":1,"any":[]})", "any"},
      {R"({"n":1,"extra":1})", "extra"},
  };
  for (const auto& [parameters, wrong] : cases) {
    const auto found = Wrong(definition, parameters);
    EXPECT_EQ(found.value_or("nothing"), wrong != nullptr ? wrong : "nothing") << parameters;
  }
}

TEST(InterfaceDefinition, RefusesWhatIsNotOne) {
  for (const char* text :
       {"", "interface", "interface a", "interface a.b\nmethod m() -> ()", "interface a.b\ntype T",
        "interface a.b\nmethod M()", "interface a.b\nmethod M(x int) -> ()", "interface a.b\nmethod M(x: nope) -> ()",
        "interface a.b\nmethod M(x: Missing) -> ()", "interface a.b\ntype T (a, b: int)",
        "interface a.b\ntype T (a_: int)", "interface a.b\ntype T (a: int)\ntype T (a: int)", "interface a.b\nnonsense",
        "interface a.b\nerror E"}) {
    const auto parsed = InterfaceDefinition::Parse(text);
    ASSERT_FALSE(parsed.has_value()) << text;
    EXPECT_TRUE(parsed.error().message.starts_with("line ")) << parsed.error().message;
  }
  std::string deep = "interface a.b\ntype T (x: ";
  for (int i = 0; i < 100000; ++i) deep += "?";
  EXPECT_FALSE(InterfaceDefinition::Parse(deep + "int)").has_value());
}

/// Every line that defines a member or a field follows a comment: the text is the manual.
TEST(LensInterface, DocumentsEverything) {
  ASSERT_TRUE(InterfaceDefinition::Parse(ServiceInterfaceText()).has_value());
  const auto definition = InterfaceDefinition::Parse(proto::LensInterfaceText()).value();
  EXPECT_EQ(definition.name(), proto::kLensInterface);
  for (const char* method :
       {"List", "Status", "Monitor", "Move", "Home", "Stop", "Plan", "Autofocus", "AutofocusBegin", "AutofocusPixels",
        "AutofocusFrame", "AutofocusScore", "AutofocusEnd", "Snapshot", "View", "SetExposure"}) {
    EXPECT_TRUE(definition.methods().contains(method)) << method;
  }
  std::string_view text = definition.text();
  bool documented = false;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const std::size_t start = line.find_first_not_of(' ');
    const bool comment = start != line.npos && line[start] == '#';
    const bool defines = !comment && start != line.npos && line[start] != ')';
    EXPECT_TRUE(documented || !defines) << line;
    documented = comment;
  }
}

}  // namespace
}  // namespace lensd::varlink
