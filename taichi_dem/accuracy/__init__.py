"""How ``solve`` finds an answer: the method and its steps, and the runs that it makes."""
