// Checks of options' values that CLI11 lacks.
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

namespace tessera::cli {

// A number that is one: CLI11's ranges let "nan" pass, for it is neither below nor above.
inline CLI::Validator Finite() {
  return {[](std::string& text) {
            double number = 0;
            const bool finite = CLI::detail::lexical_cast(text, number) && std::isfinite(number);
            return finite ? std::string() : "must be a finite number, got " + text;
          },
          ""};
}

}  // namespace tessera::cli
