# Finds sources that use what a precompiled header declares and do not include that header, themselves or by a header of the
# repository; a build with precompiled headers cannot.
#
#   printf '%s\n' net/channel.cpp net/outbox.h | awk -v root=/repo/ -f cmake/source_names.awk -f cmake/missing_includes.awk
#
# Prints a line for each fault and exits with 1 if there is one.

BEGIN {
  declare("algorithm", "std::(sort|stable_sort|min|max|clamp|find_if|any_of|all_of|none_of|count_if|remove_if|lower_bound|" \
          "upper_bound|fill|copy|transform|reverse|nth_element|max_element|min_element|rotate|unique|binary_search)\\(")
  declare("array", "std::array[<{]")
  declare("chrono", "std::chrono::")
  declare("cmath", "std::(sqrt|abs|floor|ceil|pow|sin|cos|exp|log|isfinite|isnan|hypot|round|lround)\\(")
  declare("functional", "std::function<")
  declare("map", "std::(multi)?map<")
  declare("memory", "std::(unique_ptr|shared_ptr|weak_ptr|make_unique|make_shared)<")
  declare("optional", "std::(optional<|nullopt)")
  declare("set", "std::(multi)?set<")
  declare("span", "std::span[<(]")
  declare("string", "std::(string|to_string)[^A-Za-z0-9_]")
  declare("vector", "std::vector<")
  declare("absl/status/statusor.h", "absl::StatusOr<")
  declare("absl/strings/str_cat.h", "absl::Str(Cat|Append)\\(")
  declare("absl/strings/str_join.h", "absl::StrJoin\\(")
}

{
  read_names($0)
  split("", found)
  while ((getline line < (root $0)) > 0) {
    sub(/\/\/.*/, "", line)
    if (line !~ /::/) continue
    for (i = 1; i <= count; i++) {
      if (!(header[i] in included) && !("<" header[i] ">" in included) && !(header[i] in found) && line ~ use[i]) {
        print $0 " uses <" header[i] "> and does not include it"
        found[header[i]]
        faults++
      }
    }
  }
  close(root $0)
}

END { exit faults > 0 }

function declare(name, pattern) {
  header[++count] = name
  use[count] = pattern
}
