# What the scripts beside it read out of statistics. Expects $work, their folder.

value() {  # name, JSON key of a number: the first of that name
  grep -o "\"$2\": *[0-9.e+-]*" "$work/$1.json" | head -1 | sed 's/.*: *//'
}
median() { sort -g | sed -n 2p; }  # of three
