"""How ``solve_response`` finds an answer: scenes that continue, estimates, narrowing of bars."""
