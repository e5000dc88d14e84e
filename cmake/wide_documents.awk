# Finds lines of prose in documents that are wider than 120 columns, and an overview that has outgrown its 200 lines.
# Rows of tables and blocks of code are as wide as they are.
#
#   awk -f cmake/wide_documents.awk FILE.md...       prints a line for each, and exits with 1 if there is one

function report(what) {
  printf "%s:%d: %s\n", FILENAME, FNR, what
  found = 1
}

FNR == 1 { code = 0 }
/^ *```/ {
  code = !code
  next
}
length($0) > 120 && !code && !/^ *\|/ { report(length($0) " columns; 120 fit") }
FNR == 201 && FILENAME ~ /(^|\/)architecture\.md$/ { report("more than 200 lines") }
END { exit found }
