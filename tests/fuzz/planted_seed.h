// Seeds of formats that change: each run of a fuzzer writes them with the code that it tests, so they are never of an
// older version, which would be refused at its first byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

namespace tessera::fuzz {

// Writes a seed into the first folder of the command line, to which libFuzzer adds what it finds. Without one nothing
// is written: a single input is tried again.
inline void PlantSeed(int argc, char** argv, const std::string& name, std::span<const std::uint8_t> bytes) {
  for (int i = 1; i < argc; ++i) {
    if (argv[i][0] == '-' || !std::filesystem::is_directory(argv[i])) continue;
    std::ofstream file(std::string(argv[i]) + "/planted_" + name, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return;
  }
}

}  // namespace tessera::fuzz
