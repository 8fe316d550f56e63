"""The driving experiment (Table 3): each picture of one camera finds its partner among those of the other."""
