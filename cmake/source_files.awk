# Lists what goes into each source: lines "source<TAB>file" for itself and the files of the repository that it includes.
#
#   printf '%s\n' net/channel.cpp net/outbox.cpp | awk -v root=/repo/ -f cmake/source_names.awk -f cmake/source_files.awk

{
  read_names($0)
  for (path in included) {
    if (!(path in exists)) exists[path] = path !~ /^</ && (getline line < (root path)) >= 0
    if (exists[path]) print $0 "\t" path
    close(root path)
  }
}
