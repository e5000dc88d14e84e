# Finds comments that open with "what", "who" or "of": they name no subject, and have to be read twice (CONTRIBUTING.md).
#
#   awk -f cmake/comment_openings.awk FILE...       prints a line for each, and exits with 1 if there is one
#
# A comment opens where its first line does, and behind code. Within one, a line that begins with a capital opens a sentence.

function opens(text, capital) {
  return text ~ (capital ? "^(What|Who|Whom|Whose|Of)[ ,:]" : "^([Ww]hat|[Ww]ho|[Ww]hom|[Ww]hose|[Oo]f)[ ,:]")
}

FNR == 1 {
  within = block = 0
  slashes = FILENAME ~ /\.(h|hpp|inl|c|cpp|proto|ts|mjs)$/
  mark = slashes ? "//+" : FILENAME ~ /\.lua$/ ? "--+" : "#+"
}
{
  text = ""
  full = behind = 0
  if (slashes && match($0, /^[ \t]*\/\*+[ \t]*/)) {
    full = 1
    within = 0
    block = 1
  } else if (block) {
    full = match($0, /^[ \t]*\*?[ \t]*/)
  } else if (match($0, "^[ \t]*" mark "[ \t]*")) {
    full = 1
  } else if (match($0, slashes ? "[^ \t].*[ \t](//|/\\*)[ \t]*" : "[^ \t].*  " mark "[ \t]+")) {
    behind = 1
  }
  if (full || behind) text = substr($0, RSTART + RLENGTH)
  if ((full && opens(text, within)) || (behind && opens(text, 0))) {
    printf "%s:%d: the comment opens with \"%s\"\n", FILENAME, FNR, substr(text, 1, match(text, /[ ,:]/) - 1)
    found = 1
  }
  within = full || behind
  if (block && $0 ~ /\*\//) block = within = 0
}
END { exit found }
