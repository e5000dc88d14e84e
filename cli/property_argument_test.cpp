#include "cli/property_argument.h"

#include <gmock/gmock.h>

#include <string>

#include "local_cluster/command_error.h"

namespace tessera::cli {
namespace {

using ::testing::HasSubstr;

// It declares one property of each type, named by it; and one of the world.
v1::Instance Declaring() {
  v1::Instance instance;
  const auto add = [&](const char* name) -> v1::Property& {
    v1::Property& property = *instance.add_properties();
    property.set_name(name);
    return property;
  };
  add("text").set_text("");
  add("number").set_number(0);
  add("real").set_real(0);
  add("vector").mutable_vector();
  add("body").set_body(0);
  add("bytes").set_bytes("");
  add("flag").set_flag(false);
  v1::Property& own = *instance.add_world_properties();
  own.set_name("score");
  own.set_number(0);
  return instance;
}

v1::Property Read(const std::string& name, const std::string& value) {
  return ReadProperty(Declaring(), false, name, value);
}

std::string Refusal(bool of_world, const std::string& name, const std::string& value) {
  try {
    (void)ReadProperty(Declaring(), of_world, name, value);
  } catch (const local::CommandError& error) {
    return error.what();
  }
  return "";
}

TEST(PropertyArgumentTest, AValueIsReadAsTheDeclaredType) {
  EXPECT_EQ(Read("text", "7").text(), "7");
  EXPECT_EQ(Read("number", "-7").number(), -7);
  EXPECT_EQ(Read("real", "1.5").real(), 1.5);
  EXPECT_EQ(Read("vector", "1,-2,0.5").vector().y(), -2);
  EXPECT_EQ(Read("body", "1000005").body(), 1000005u);
  EXPECT_EQ(Read("bytes", "00fF").bytes(), std::string("\0\xff", 2));
  EXPECT_TRUE(Read("flag", "true").flag());
  EXPECT_TRUE(Read("flag", "false").has_flag());
  EXPECT_EQ(ReadProperty(Declaring(), true, "score", "3").name(), "score");
}

TEST(PropertyArgumentTest, AValueOfAnotherTypeIsRefused) {
  EXPECT_THAT(Refusal(false, "number", "1.5"), HasSubstr("VALUE: property \"number\" is a whole number, not \"1.5\""));
  EXPECT_THAT(Refusal(false, "real", "fast"), HasSubstr("is a number"));
  EXPECT_THAT(Refusal(false, "vector", "1,2"), HasSubstr("is three numbers x,y,z"));
  EXPECT_THAT(Refusal(false, "body", "-1"), HasSubstr("is the id of a body"));
  EXPECT_THAT(Refusal(false, "bytes", "0ff"), HasSubstr("is bytes"));
  EXPECT_THAT(Refusal(false, "flag", "1"), HasSubstr("is true or false"));
}

TEST(PropertyArgumentTest, ANameThatIsNotDeclaredIsRefusedWithThoseThatAre) {
  EXPECT_THAT(Refusal(true, "health", "1"),
              HasSubstr("KEY: the scene declares no property \"health\"; it declares: score"));
  EXPECT_THAT(Refusal(false, "score", "1"), HasSubstr("it declares: text, number"));
}

}  // namespace
}  // namespace tessera::cli
