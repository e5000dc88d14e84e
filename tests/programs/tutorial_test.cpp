// docs/tutorial.md, carried out word for word.
#include <gmock/gmock.h>

#include "tests/programs/carry_out.h"
#include "tests/programs/documents.h"
#include "tests/programs/terminal.h"

namespace tessera::programs {
namespace {

TEST(TutorialTest, CarriedOutWordForWordItDoesWhatItSays) {
  Terminal terminal;
  const Carried carried = CarryOut(ReadFenced(kTutorial), terminal);
  EXPECT_GT(carried.commands, 15);
  EXPECT_GT(carried.shown, 20);
}

}  // namespace
}  // namespace tessera::programs
